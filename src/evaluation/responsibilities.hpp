// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace unirit {

/// Which source point explains which target point: the expectation step of coherent point drift,
/// reduced to the sums that its maximisation needs. p(m, n) = exp(-|x_n - y_m|^2 / (2 variance)) /
/// (sum over m of the same + outlier).
struct Responsibilities {
  Eigen::RowVectorXd of_source;       ///< M: sum of p(m, n) over n
  Eigen::RowVectorXd of_target;       ///< N: sum of p(m, n) over m
  Eigen::Matrix3Xd weighted_targets;  ///< 3 x M: sum of p(m, n) x_n over n
  double log_sum = 0.0;               ///< sum over n of the logarithm of the denominator

  double total() const { return of_source.sum(); }

  /// sum of p(m, n) |x_n - y_m|^2 for other places y of the source points.
  double squaredDistances(const Eigen::Matrix3Xd& target, const Eigen::Matrix3Xd& source) const;
};

/// `source`: y, 3 x M; `target`: x, 3 x N; `outlier` >= 0: weight of a uniform background.
Responsibilities responsibilities(const Eigen::Matrix3Xd& source, const Eigen::Matrix3Xd& target,
                                  double variance, double outlier);

}  // namespace unirit
