// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <vector>

#include "network/kernels.hpp"

namespace unirit {
namespace {

TEST(Sanitizers, SeeWhereAKernelLeavesTheHeap) {
  const Kernels& kernels = selectKernels();
  const long order = kernels.panel_width;
  std::vector<float> matrix(static_cast<std::size_t>(order * order - 1), 1.0F);
  EXPECT_DEATH(kernels.cholesky(matrix.data(), order), "AddressSanitizer: .* on address");
}

}  // namespace
}  // namespace unirit
