// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <torch/torch.h>

namespace unirit::training {

/// From each point to its nearest neighbour in `to`: [B, N, 3].
torch::Tensor offsets(const torch::Tensor& from, const torch::Tensor& to);

/// At most so many of the numbers from 0 to all - 1, evenly spread: [min(all, at_most)].
torch::Tensor evenlyChosen(std::int64_t all, std::int64_t at_most, torch::Device device);

/// What the flow module reads of two clouds, as architecture.hpp lists it.
struct Surroundings {
  torch::Tensor of_source;  ///< [B, N, kFlowInputs]
  torch::Tensor of_target;  ///< [B, M, kFlowTargetInputs]
};

/// Of source, [B, N, 3], and target, [B, M, 3]; no gradient passes through.
Surroundings surroundings(const torch::Tensor& source, const torch::Tensor& deformation,
                          const torch::Tensor& target);

/// The same by LibTorch's operations alone, as other devices need it.
Surroundings onAnyDevice(const torch::Tensor& source, const torch::Tensor& deformation,
                         const torch::Tensor& target);

}  // namespace unirit::training
