// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <torch/torch.h>

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "unirit/network/weights.hpp"

namespace unirit::speed {

/// The network as one would write it for inference in LibTorch, with the same two exact savings and
/// pairing nearest. Clouds are tensors [N, 3].
class LibtorchNetwork {
 public:
  explicit LibtorchNetwork(const Weights& weights);

  /// The source moved by the estimated rigid transform, [N, 3].
  torch::Tensor moveRigidly(torch::Tensor source, const torch::Tensor& target,
                            int iterations) const;

  /// The displacement of each point of the rigidly moved source, [N, 3].
  torch::Tensor estimateDisplacements(const torch::Tensor& source,
                                      const torch::Tensor& target) const;

 private:
  struct Linear {
    torch::Tensor weight, bias;
  };
  using Stack = std::vector<Linear>;

  static torch::Tensor run(const Stack& layers, torch::Tensor values);
  torch::Tensor encode(const std::string& name, const torch::Tensor& points) const;

  std::map<std::string, Stack> stacks_;  ///< by the layers' names up to the last dot
  Linear point_layer_, feature_layer_;   ///< the non-rigid decoder's first layer, by its columns
};

}  // namespace unirit::speed
