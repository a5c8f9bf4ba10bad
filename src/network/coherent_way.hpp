// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cholesky_factor.hpp"
#include "unirit/point_cloud.hpp"

namespace unirit {

/// The motion of a surface, rigid and smoothly deforming, that takes points of it onto planes: the
/// posterior mean of v(x) = t + w x p + d(x), where t and w are normal of standard deviation
/// kFlowRigidAmplitude and d a Gaussian process of covariance a^2 e^(-r^2 / 2 l^2), an axis like
/// another, given n_j . v(p_j) = n_j . o_j with noise (Rasmussen & Williams 2006, eq. 2.23).
class CoherentWay {
 public:
  /// `kernels` must outlive it.
  explicit CoherentWay(const Kernels& kernels) : kernels_(kernels), factor_(kernels) {}

  /// Points p, the offsets o to points of their planes and the normals n, [3, N] each; allocates
  /// nothing where the number stays. Throws std::runtime_error where rounding leaves no solution.
  void fit(const Points& points, const Points& offsets, const Points& normals);

  /// Of each p, what it adds to d: d(x) = sum of e^(-|x - p|^2 / 2 l^2) times this.
  const Points& sources() const { return sources_; }

  /// t + w x p.
  Eigen::Vector3f rigid(const Eigen::Vector3f& point) const {
    return translation_ + turn_.cross(point);
  }

 private:
  void findGaussians(const Points& points);

  const Kernels& kernels_;
  Points sources_;
  Eigen::Vector3f translation_, turn_;
  Eigen::Matrix<float, Eigen::Dynamic, 6> wrenches_;     // n and p x n, of each
  Eigen::Matrix<float, Eigen::Dynamic, 3> coordinates_;  // of the points, in whole blocks
  Eigen::MatrixXf gaussians_;                            // e^(-|p_i - p_j|^2 / 2 l^2)
  Eigen::MatrixXf covariance_;
  CholeskyFactor factor_;
  Eigen::VectorXf gains_;
};

}  // namespace unirit
