// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <torch/torch.h>

#include <string>
#include <vector>

#include "unirit/network/weights.hpp"

namespace unirit::training {

/// Fully connected layers of the given widths, each followed by a ReLU but, where `linear_end`, the
/// last. Children are named "0", "1", ...
class PerceptronImpl : public torch::nn::Module {
 public:
  PerceptronImpl(const std::vector<int>& widths, bool linear_end);

  /// [..., inputs] -> [..., outputs]
  torch::Tensor forward(torch::Tensor values);

  /// From the second layer on, for a first layer's output (before its ReLU) computed elsewhere.
  torch::Tensor continueFrom(torch::Tensor first_output);

  torch::nn::Linear layer(std::size_t i) const { return layers_[i]; }

 protected:
  std::vector<torch::nn::Linear> layers_;
  bool linear_end_;
};
TORCH_MODULE(Perceptron);

/// Shared perceptron over points, then the maximum: [B, N, encoderInputs(pairing)] -> [B, 1024]. On
/// the CPU the gradient of the last layer is taken only through the points that hold a maximum,
/// which is exact.
class EncoderImpl : public PerceptronImpl {
 public:
  explicit EncoderImpl(Pairing pairing);
  torch::Tensor forward(torch::Tensor points);
};
TORCH_MODULE(Encoder);

/// Rigid transforms of a batch: p -> rotation p + translation.
struct Pose {
  torch::Tensor rotation;     ///< [B, 3, 3]
  torch::Tensor translation;  ///< [B, 3]

  torch::Tensor apply(const torch::Tensor& points) const;  ///< [B, N, 3] -> [B, N, 3]
};

/// One iteration of the paper's rigid module.
class RigidModuleImpl : public torch::nn::Module {
 public:
  explicit RigidModuleImpl(Pairing pairing);

  /// `target_feature` starts undefined for each target; it is computed in the first iteration, and
  /// in all where it changes with the source's pose.
  Pose forward(const torch::Tensor& moved_source, const torch::Tensor& target,
               torch::Tensor& target_feature);

 private:
  Pairing pairing_;
  Encoder source_encoder_, target_encoder_;
  Perceptron decoder_;
};
TORCH_MODULE(RigidModule);

/// The non-rigid module: displacement of every point of the rigidly moved source.
class NonRigidModuleImpl : public torch::nn::Module {
 public:
  explicit NonRigidModuleImpl(Pairing pairing);
  torch::Tensor forward(const torch::Tensor& moved_source, const torch::Tensor& target);

 private:
  Pairing pairing_;
  Encoder source_encoder_, target_encoder_;
  Perceptron decoder_;
};
TORCH_MODULE(NonRigidModule);

/// The whole of UniRiT, with the layer names of the weights file.
class UniritImpl : public torch::nn::Module {
 public:
  explicit UniritImpl(Pairing pairing);

  RigidModule rigid;
  NonRigidModule nonrigid;

  /// Replaces every parameter; throws std::invalid_argument where the pairing is another or a layer
  /// is missing. Weights of pairing nearest serve pairing offsets, too: what the encoders read
  /// beside a point then counts for nothing until it is trained.
  void setWeights(const Weights& weights);

  /// The parameters as a weights file holds them, without metadata.
  Weights weights() const;

  Pairing pairing() const { return pairing_; }

 private:
  Pairing pairing_;
};
TORCH_MODULE(Unirit);

/// From each point to its nearest neighbour in `to`: [B, N, 3].
torch::Tensor offsets(const torch::Tensor& from, const torch::Tensor& to);

}  // namespace unirit::training
