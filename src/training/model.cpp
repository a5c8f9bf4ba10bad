// SPDX-License-Identifier: BSD-3-Clause
#include "model.hpp"

#include <stdexcept>

#include "max_linear.hpp"

namespace unirit::training {
namespace {

/// Inputs and outputs of a stack of layers in one row.
template <std::size_t Size>
std::vector<int> stack(int inputs, const std::array<int, Size>& outputs) {
  std::vector<int> widths{inputs};
  widths.insert(widths.end(), outputs.begin(), outputs.end());
  return widths;
}

/// What an encoder of so many inputs reads of `points` beside the other cloud: [B, N, inputs].
torch::Tensor encoderInput(int inputs, const torch::Tensor& points, const torch::Tensor& other) {
  return inputs == 3 ? points : torch::cat({points, offsets(points, other)}, 2);
}

/// Unit quaternions w x y z, [B, 4], to rotations, [B, 3, 3].
torch::Tensor rotationOf(const torch::Tensor& quaternion) {
  const auto parts = torch::nn::functional::normalize(quaternion).unbind(1);
  const auto &w = parts[0], &x = parts[1], &y = parts[2], &z = parts[3];
  const auto rows =
      torch::stack({1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),  //
                    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),  //
                    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)},
                   1);
  return rows.view({-1, 3, 3});
}

}  // namespace

PerceptronImpl::PerceptronImpl(const std::vector<int>& widths, bool linear_end)
    : linear_end_(linear_end) {
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    layers_.push_back(
        register_module(std::to_string(i), torch::nn::Linear(widths[i], widths[i + 1])));
  }
}

torch::Tensor PerceptronImpl::forward(torch::Tensor values) {
  return continueFrom(layers_.front()->forward(values));
}

torch::Tensor PerceptronImpl::continueFrom(torch::Tensor first_output) {
  torch::Tensor values = std::move(first_output);
  for (std::size_t i = 1; i < layers_.size(); ++i) {
    values = layers_[i]->forward(torch::relu(values));
  }
  return linear_end_ ? values : torch::relu(values);
}

EncoderImpl::EncoderImpl(const std::vector<int>& widths) : PerceptronImpl(widths, false) {}

torch::Tensor EncoderImpl::forward(torch::Tensor points) {
  torch::Tensor values = std::move(points);
  for (std::size_t i = 0; i + 1 < layers_.size(); ++i) {
    values = torch::relu(layers_[i]->forward(values));
  }
  // The maximum over points commutes with the ReLU.
  return torch::relu(maxLinear(values, layers_.back()->weight, layers_.back()->bias));
}

torch::Tensor Pose::apply(const torch::Tensor& points) const {
  return torch::baddbmm(translation.unsqueeze(1), points, rotation.transpose(1, 2));
}

RigidModuleImpl::RigidModuleImpl(const std::vector<int>& encoder, const std::vector<int>& decoder)
    : inputs_(encoder.front()),
      source_encoder_(register_module("source_encoder", Encoder(encoder))),
      target_encoder_(register_module("target_encoder", Encoder(encoder))),
      decoder_(register_module("decoder", Perceptron(decoder, true))) {}

Pose RigidModuleImpl::forward(const torch::Tensor& moved_source, const torch::Tensor& target,
                              torch::Tensor& target_feature) {
  if (!target_feature.defined() || inputs_ == kOffsetInputs) {
    target_feature = target_encoder_->forward(encoderInput(inputs_, target, moved_source));
  }
  const auto source_feature = source_encoder_->forward(encoderInput(inputs_, moved_source, target));
  const auto output = decoder_->forward(torch::cat({source_feature, target_feature}, 1));
  return {rotationOf(output.slice(1, 0, 4)), output.slice(1, 4, 7)};
}

NonRigidModuleImpl::NonRigidModuleImpl(Pairing pairing)
    : pairing_(pairing),
      source_encoder_(register_module(
          "source_encoder", Encoder(stack(nonRigidEncoderInputs(pairing), kEncoderWidths)))),
      target_encoder_(register_module(
          "target_encoder", Encoder(stack(nonRigidEncoderInputs(pairing), kEncoderWidths)))),
      decoder_(register_module(
          "decoder",
          Perceptron(stack(nonRigidDecoderInputs(pairing), kNonRigidDecoderWidths), true))) {}

torch::Tensor NonRigidModuleImpl::forward(const torch::Tensor& moved_source,
                                          const torch::Tensor& target,
                                          c10::optional<std::int64_t> points) {
  const int inputs = nonRigidEncoderInputs(pairing_);
  const auto source_input = encoderInput(inputs, moved_source, target);
  const auto features =
      torch::cat({source_encoder_->forward(source_input),
                  target_encoder_->forward(encoderInput(inputs, target, moved_source))},
                 1);
  torch::Tensor local = source_input;  // what the decoder reads of each point
  if (pairing_ == Pairing::kRow) local = torch::cat({moved_source, target}, 2);
  if (pairing_ == Pairing::kNearest) {
    local = torch::cat({moved_source, offsets(moved_source, target)}, 2);
  }

  // The first layer is linear: its global columns are multiplied once a pair, not once a point.
  const auto first = decoder_->layer(0);
  const auto columns = first->weight.split_with_sizes(
      {3, 2 * kFeatureSize, first->weight.size(1) - 3 - 2 * kFeatureSize}, 1);
  const auto global = torch::linear(features, columns[1], first->bias);
  const auto point =
      torch::linear(local.slice(1, 0, points), torch::cat({columns[0], columns[2]}, 1));
  return decoder_->continueFrom(point + global.unsqueeze(1));
}

UniritImpl::UniritImpl(Pairing pairing)
    : rigid(register_module("rigid", RigidModule(stack(3, kEncoderWidths),
                                                 stack(2 * kFeatureSize, kRigidDecoderWidths)))),
      nonrigid(register_module("nonrigid", NonRigidModule(pairing))),
      pairing_(pairing) {
  if (pairing != Pairing::kOffsets) return;
  fine = register_module("fine",
                         RigidModule(stack(kOffsetInputs, kFineEncoderWidths),
                                     stack(2 * kFineEncoderWidths.back(), kFineDecoderWidths)));
}

torch::Tensor UniritImpl::moveRigidly(const torch::Tensor& source, const torch::Tensor& target,
                                      int iterations) {
  const int coarse = coarseIterations(pairing_, iterations);
  torch::Tensor moved = source, target_feature;
  for (int i = 0; i < iterations; ++i) {
    auto& module = i < coarse ? rigid : fine;
    moved = module->forward(moved, target, target_feature).apply(moved);
  }
  return moved;
}

void UniritImpl::setWeights(const Weights& weights) {
  const bool widened = weights.pairing == Pairing::kNearest && pairing_ == Pairing::kOffsets;
  if (weights.pairing != pairing_ && !widened) {
    throw std::invalid_argument(std::string("weights: their pairing is ") +
                                toString(weights.pairing) + ", the network's " +
                                toString(pairing_));
  }
  const torch::NoGradGuard no_grad;
  auto parameters = named_parameters();
  for (const LayerShape& shape : layerShapes(weights.pairing)) {
    const auto layer = weights.layers.find(shape.name);
    if (layer == weights.layers.end()) {
      throw std::invalid_argument("weights: layer " + shape.name + " is missing");
    }
    using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    RowMajor weight = layer->second.weight;
    Eigen::VectorXf bias = layer->second.bias;
    parameters[shape.name + ".weight"]
        .zero_()
        .slice(1, 0, shape.inputs)
        .copy_(torch::from_blob(weight.data(), {shape.outputs, shape.inputs}));
    parameters[shape.name + ".bias"].copy_(torch::from_blob(bias.data(), {shape.outputs}));
  }
}

Weights UniritImpl::weights() const {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Weights weights;
  weights.pairing = pairing_;
  const auto parameters = named_parameters();
  for (const LayerShape& shape : layerShapes(pairing_)) {
    const auto weight = parameters[shape.name + ".weight"].detach().cpu().contiguous();
    const auto bias = parameters[shape.name + ".bias"].detach().cpu().contiguous();
    weights.layers[shape.name] = {
        Eigen::Map<const RowMajor>(weight.data_ptr<float>(), shape.outputs, shape.inputs),
        Eigen::Map<const Eigen::VectorXf>(bias.data_ptr<float>(), shape.outputs)};
  }
  return weights;
}

torch::Tensor offsets(const torch::Tensor& from, const torch::Tensor& to) {
  torch::Tensor index;
  {
    const torch::NoGradGuard no_grad;
    const at::NoTF32Guard no_tf32;  // its ten bits do not tell near points apart
    index = torch::cdist(from, to).argmin(2);
  }
  return to.gather(1, index.unsqueeze(2).expand({-1, -1, 3})) - from;
}

}  // namespace unirit::training
