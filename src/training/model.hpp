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

/// Shared perceptron over points, then the maximum: [B, N, inputs] -> [B, feature size]. On the CPU
/// the gradient of the last layer is taken only through the points that hold a maximum,
/// which is exact.
class EncoderImpl : public PerceptronImpl {
 public:
  explicit EncoderImpl(const std::vector<int>& widths);
  torch::Tensor forward(torch::Tensor points);
};
TORCH_MODULE(Encoder);

/// Rigid transforms of a batch: p -> rotation p + translation.
struct Pose {
  torch::Tensor rotation;     ///< [B, 3, 3]
  torch::Tensor translation;  ///< [B, 3]

  torch::Tensor apply(const torch::Tensor& points) const;  ///< [B, N, 3] -> [B, N, 3]
};

/// The rigid transform that fits a batch of points to others best, row by row, [B, N, 3] each
/// (Umeyama 1991).
Pose bestRigidFit(const torch::Tensor& from, const torch::Tensor& to);

/// One iteration of the paper's rigid module.
class RigidModuleImpl : public torch::nn::Module {
 public:
  RigidModuleImpl();

  /// `target_feature` starts undefined for each target; it is computed in the first iteration.
  Pose forward(const torch::Tensor& moved_source, const torch::Tensor& target,
               torch::Tensor& target_feature);

 private:
  Encoder source_encoder_, target_encoder_;
  Perceptron decoder_;
};
TORCH_MODULE(RigidModule);

/// The non-rigid module: displacement of the first `points` of the rigidly moved source, [B, P, 3],
/// of all without a number.
class NonRigidModuleImpl : public torch::nn::Module {
 public:
  explicit NonRigidModuleImpl(Pairing pairing);
  torch::Tensor forward(const torch::Tensor& moved_source, const torch::Tensor& target,
                        c10::optional<std::int64_t> points = c10::nullopt);

 private:
  Pairing pairing_;
  Encoder source_encoder_, target_encoder_;
  Perceptron decoder_;
};
TORCH_MODULE(NonRigidModule);

/// The module of pairing offsets, of both stages: the flow of the source, [B, N, 3], from where it
/// has reached since it began.
class FlowModuleImpl : public torch::nn::Module {
 public:
  FlowModuleImpl();
  torch::Tensor forward(const torch::Tensor& start, const torch::Tensor& reached,
                        const torch::Tensor& target);

 private:
  Encoder source_encoder_, target_encoder_;
  Perceptron decoder_;
};
TORCH_MODULE(FlowModule);

/// Which points of clouds, [B, N, 3], coarse iterations read by flow, in the order of their first
/// coordinates: [B, K].
torch::Tensor coarseOrder(const torch::Tensor& points);

/// Those points: [B, K, 3].
torch::Tensor ordered(const torch::Tensor& points, const torch::Tensor& order);

/// The whole of UniRiT, with the layer names of the weights file.
class UniritImpl : public torch::nn::Module {
 public:
  explicit UniritImpl(Pairing pairing);

  RigidModule rigid{nullptr};  ///< these two with every pairing but offsets
  NonRigidModule nonrigid{nullptr};
  FlowModule flow{nullptr};  ///< with pairing offsets alone

  /// The source after so many iterations of the rigid stage, at most, where it goes by flow.
  torch::Tensor moveRigidly(const torch::Tensor& source, const torch::Tensor& target,
                            int iterations);

  /// That and the non-rigid stage.
  torch::Tensor deform(const torch::Tensor& moved_source, const torch::Tensor& target);

  /// Replaces every parameter; throws std::invalid_argument where the pairing is another or a layer
  /// is missing.
  void setWeights(const Weights& weights);

  /// The parameters as a weights file holds them, without metadata.
  Weights weights() const;

  Pairing pairing() const { return pairing_; }

 private:
  /// Where so many steps along the flow take the source.
  torch::Tensor followFlow(const torch::Tensor& source, const torch::Tensor& target, int steps);

  Pairing pairing_;
};
TORCH_MODULE(Unirit);

}  // namespace unirit::training
