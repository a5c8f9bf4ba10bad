// SPDX-License-Identifier: BSD-3-Clause
#include "gaussian_basis.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

namespace unirit {
namespace {

Eigen::ArrayXd kernel(const Eigen::Matrix3Xd& points, const Eigen::Vector3d& centre, double width) {
  return ((points.colwise() - centre).colwise().squaredNorm() / (-2.0 * width * width))
      .array()
      .exp()
      .transpose();
}

}  // namespace

GaussianBasis::GaussianBasis(const Eigen::Matrix3Xd& points, double width, double tolerance)
    : width_(width) {
  Eigen::ArrayXd unexplained = Eigen::ArrayXd::Ones(points.cols());
  std::vector<Eigen::Index> pivots;
  for (Eigen::Index rank = 0; rank < points.cols(); ++rank) {
    Eigen::Index pivot = 0;
    const double largest = unexplained.maxCoeff(&pivot);
    if (largest < tolerance) break;
    if (rank == values_.cols()) {  // grow in steps, most bases are small
      values_.conservativeResize(points.cols(), std::min(points.cols(), 2 * rank + 64));
    }
    const auto known = values_.leftCols(rank);
    values_.col(rank) = kernel(points, points.col(pivot), width).matrix();
    values_.col(rank).noalias() -= known * known.row(pivot).transpose();
    values_.col(rank) /= std::sqrt(largest);
    for (const Eigen::Index earlier : pivots) values_(earlier, rank) = 0.0;
    unexplained = (unexplained - values_.col(rank).array().square()).max(0.0);
    pivots.push_back(pivot);
    unexplained[pivot] = 0.0;
  }
  const auto rank = static_cast<Eigen::Index>(pivots.size());
  values_.conservativeResize(points.cols(), rank);
  pivots_.resize(3, rank);
  pivot_rows_.resize(rank, rank);
  for (Eigen::Index i = 0; i < rank; ++i) {
    const Eigen::Index pivot = pivots[static_cast<std::size_t>(i)];
    pivots_.col(i) = points.col(pivot);
    pivot_rows_.row(i) = values_.row(pivot);
  }
}

Eigen::MatrixXd GaussianBasis::at(const Eigen::Matrix3Xd& places) const {
  Eigen::MatrixXd kernels(pivots_.cols(), places.cols());
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    kernels.col(i) = kernel(pivots_, places.col(i), width_).matrix();
  }
  if (kernels.size() > 0) {  // Eigen would refer to the first of none
    pivot_rows_.triangularView<Eigen::Lower>().solveInPlace(kernels);
  }
  return kernels.transpose();
}

Eigen::Matrix3Xd GaussianBasis::fit(const Eigen::RowVectorXd& weights,
                                    const Eigen::Matrix3Xd& weighted_residuals,
                                    double ridge) const {
  const Eigen::MatrixXd weighted = values_.transpose() * weights.cwiseSqrt().asDiagonal();  // R x N
  Eigen::MatrixXd normal = ridge * Eigen::MatrixXd::Identity(weighted.rows(), weighted.rows());
  normal.selfadjointView<Eigen::Lower>().rankUpdate(weighted);
  const Eigen::MatrixXd right = values_.transpose() * weighted_residuals.transpose();  // R x 3
  return normal.selfadjointView<Eigen::Lower>().llt().solve(right).transpose();
}

}  // namespace unirit
