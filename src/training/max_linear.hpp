// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <torch/torch.h>

namespace unirit::training {

/// max over n of (values[b, n] . weight[c] + bias[c]): [B, N, K], [C, K], [C] -> [B, C]. Its
/// gradient flows through one point a channel, so the backward pass costs 2 B C K multiply-adds in
/// place of 2 B N C K, and no products are kept for it; it is exact.
torch::Tensor maxLinear(const torch::Tensor& values, const torch::Tensor& weight,
                        const torch::Tensor& bias);

}  // namespace unirit::training
