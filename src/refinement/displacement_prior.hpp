// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "network/dense_layer.hpp"
#include "unirit/point_cloud.hpp"

namespace unirit {

/// A smooth random displacement of the organ: a Gaussian process whose axes are independent, with
/// covariance amplitude^2 exp(-r^2 / 2 length^2), as a sum of a few functions with independent
/// standard normal coefficients. They are the leading eigenfunctions of its approximation by
/// inducing points (Quinonero-Candela & Rasmussen 2005, subset of regressors), so they are defined
/// everywhere, inside the organ too. Lengths in the unit of the surface.
class DisplacementPrior {
 public:
  /// `surface`: 3 x N points, of which at most 128 serve as inducing points. The rank is at most
  /// `rank`, less where the surface has fewer points.
  DisplacementPrior(const Points& surface, double length, double amplitude, int rank,
                    const Kernels& kernels = selectKernels());

  Eigen::Index rank() const { return weights_.cols(); }

  /// Of the displacement along each axis, anywhere: amplitude^2.
  float variance() const { return variance_; }

  /// Value of each function at each point, rank x Q.
  Eigen::MatrixXf functions(const Points& points) const;
  Eigen::MatrixXf functions(const Points& points, ThreadTeam& team) const;

  /// Displacements at the points, 3 x Q, for coefficients 3 x rank.
  Points displacements(const Points& points, const Eigen::Matrix3Xf& coefficients) const;

  /// Derivatives of these displacements by the point, one matrix a point.
  std::vector<Eigen::Matrix3f> gradients(const Points& points,
                                         const Eigen::Matrix3Xf& coefficients) const;

 private:
  Eigen::MatrixXf covariances(const Points& points) const;  // inducing points x Q
  DenseLayer layerOf(const Eigen::MatrixXf& weights) const;
  template <class Use>
  void multiply(const DenseLayer& layer, const Points& points, ThreadTeam& team,
                const Use& use) const;

  const Kernels& kernels_;
  Points inducing_;
  float exponent_;  // of the squared distance
  float variance_;
  Eigen::MatrixXf weights_;  // inducing points x rank
  long padded_;              // inducing points, to whole blocks
  AlignedFloats targets_;    // the same as the kernels read them: rows x, y, z
};

}  // namespace unirit
