// SPDX-License-Identifier: BSD-3-Clause
#include "responsibilities.hpp"

#include <algorithm>
#include <cmath>

namespace unirit {
namespace {

constexpr Eigen::Index kBlock = 64;       // target points at a time: their terms stay in the cache
constexpr double kLeastOutlier = 1e-250;  // target points out of reach of all explain nothing

}  // namespace

double Responsibilities::squaredDistances(const Eigen::Matrix3Xd& target,
                                          const Eigen::Matrix3Xd& source) const {
  return of_target.dot(target.colwise().squaredNorm()) +
         of_source.dot(source.colwise().squaredNorm()) -
         2.0 * weighted_targets.cwiseProduct(source).sum();
}

Responsibilities responsibilities(const Eigen::Matrix3Xd& source, const Eigen::Matrix3Xd& target,
                                  double variance, double outlier) {
  const Eigen::ArrayX3d y = source.transpose().array();
  Responsibilities sums;
  sums.of_target.resize(target.cols());
  Eigen::MatrixX4d of_source = Eigen::MatrixX4d::Zero(source.cols(), 4);  // weighted x, y, z, 1
  Eigen::MatrixXd terms(source.cols(), kBlock);
  for (Eigen::Index first = 0; first < target.cols(); first += kBlock) {
    const Eigen::Index count = std::min(kBlock, target.cols() - first);
    Eigen::MatrixX4d x(count, 4);
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::Vector3d point = target.col(first + j);
      terms.col(j) = (((y.col(0) - point.x()).square() + (y.col(1) - point.y()).square() +
                       (y.col(2) - point.z()).square()) /
                      (-2.0 * variance))
                         .exp();
      const double sum = terms.col(j).sum();
      const double denominator = sum + std::max(outlier, kLeastOutlier);
      sums.of_target[first + j] = sum / denominator;
      sums.log_sum += std::log(denominator);
      x.row(j) << point.transpose() / denominator, 1.0 / denominator;
    }
    of_source.noalias() += terms.leftCols(count) * x;
  }
  sums.weighted_targets = of_source.leftCols<3>().transpose();
  sums.of_source = of_source.col(3).transpose();
  return sums;
}

}  // namespace unirit
