// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <torch/torch.h>

namespace unirit::training {

/// max over n of (values[b, n] . weight[c] + bias[c]): [B, N, K], [C, K], [C] -> [B, C]. Its
/// gradient flows through one point a channel, so on the CPU the backward pass costs B C K
/// multiply-adds in place of 2 B N C K; the gradient is exact either way.
torch::Tensor maxLinear(const torch::Tensor& values, const torch::Tensor& weight,
                        const torch::Tensor& bias);

}  // namespace unirit::training
