// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace unirit {

/// Functions over space whose products are the Gaussian kernel's matrix over some points:
/// basis * basis' = G with G(i,j) = exp(-|p_i - p_j|^2 / (2 width^2)), to `tolerance`, in
/// (0, 1), in each diagonal element. A displacement field of a Gaussian process is then a sum of
/// few of them, and its prior energy trace(W' G W) the squared norm of the coefficients. By pivoted
/// Cholesky decomposition.
class GaussianBasis {
 public:
  /// `points`: 3 x N.
  GaussianBasis(const Eigen::Matrix3Xd& points, double width, double tolerance);

  /// N x R: the functions' values at the points.
  const Eigen::MatrixXd& values() const { return values_; }

  /// M x R: their values anywhere; at the points those of values().
  Eigen::MatrixXd at(const Eigen::Matrix3Xd& places) const;

  /// 3 x R coefficients c that minimise sum_i w_i |r_i - (c basis')_i|^2 + ridge |c|^2, from
  /// `weights` w (N) and `weighted_residuals` w_i r_i (3 x N).
  Eigen::Matrix3Xd fit(const Eigen::RowVectorXd& weights,
                       const Eigen::Matrix3Xd& weighted_residuals, double ridge) const;

 private:
  double width_;
  Eigen::Matrix3Xd pivots_;     // 3 x R, those of the points that span the basis
  Eigen::MatrixXd pivot_rows_;  // R x R, lower triangular: the basis at the pivots
  Eigen::MatrixXd values_;
};

}  // namespace unirit
