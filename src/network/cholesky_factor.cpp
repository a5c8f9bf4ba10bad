// SPDX-License-Identifier: BSD-3-Clause
#include "cholesky_factor.hpp"

namespace unirit {

bool CholeskyFactor::compute(const Eigen::MatrixXf& matrix) {
  size_ = matrix.rows();
  const Eigen::Index width = kernels_.panel_width;
  order_ = (size_ + width - 1) / width * width;
  values_.ensure(static_cast<std::size_t>(order_ * order_));
  Eigen::Map<Eigen::MatrixXf> values(values_.data(), order_, order_);
  values.topLeftCorner(size_, size_).triangularView<Eigen::Lower>() = matrix;
  values.bottomRows(order_ - size_).setZero();
  values.diagonal().tail(order_ - size_).setOnes();
  kernels_.cholesky(values_.data(), order_);
  return values.diagonal().allFinite();
}

void CholeskyFactor::solveInPlace(Eigen::VectorXf& b) const {
  const auto factor = matrixL().triangularView<Eigen::Lower>();
  factor.solveInPlace(b);
  factor.transpose().solveInPlace(b);
}

}  // namespace unirit
