// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "aligned_floats.hpp"
#include "kernels.hpp"

namespace unirit {

/// L of A = L L^T, for one matrix after the other in the same memory.
class CholeskyFactor {
 public:
  /// `kernels` must outlive it.
  explicit CholeskyFactor(const Kernels& kernels) : kernels_(kernels) {}

  /// Factors a symmetric matrix, of which it reads the lower half. False where it is not positive
  /// definite; what is solved then is not finite.
  bool compute(const Eigen::MatrixXf& matrix);

  /// After compute; what stands above the diagonal means nothing.
  Eigen::Map<const Eigen::MatrixXf, 0, Eigen::OuterStride<>> matrixL() const {
    return {values_.data(), size_, size_, Eigen::OuterStride<>(order_)};
  }

  /// After compute: replaces b by A^-1 b.
  void solveInPlace(Eigen::VectorXf& b) const;

 private:
  const Kernels& kernels_;
  Eigen::Index size_ = 0;
  Eigen::Index order_ = 0;  // the size in whole panels
  AlignedFloats values_;    // order x order, the identity past the size
};

}  // namespace unirit
