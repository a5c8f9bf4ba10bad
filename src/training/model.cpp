// SPDX-License-Identifier: BSD-3-Clause
#include "model.hpp"

#include <stdexcept>

#include "max_linear.hpp"
#include "surroundings.hpp"

namespace unirit::training {
namespace {

/// Inputs and outputs of a stack of layers in one row.
template <std::size_t Size>
std::vector<int> stack(int inputs, const std::array<int, Size>& outputs) {
  std::vector<int> widths{inputs};
  widths.insert(widths.end(), outputs.begin(), outputs.end());
  return widths;
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

/// In the order of the first coordinates.
torch::Tensor sorted(const torch::Tensor& points) {
  return ordered(points, points.select(2, 0).argsort(1, false));
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

Pose bestRigidFit(const torch::Tensor& from, const torch::Tensor& to) {
  const auto from_centre = from.mean(1, true), to_centre = to.mean(1, true);
  const auto covariance = torch::bmm((from - from_centre).transpose(1, 2), to - to_centre);
  const auto [u, values, v_transposed] = torch::linalg_svd(covariance.to(torch::kDouble), false);
  auto v = v_transposed.transpose(1, 2).clone();
  v.select(2, 2).mul_(torch::linalg_det(torch::bmm(u, v_transposed)).sign().unsqueeze(1));
  const auto rotation = torch::bmm(v, u.transpose(1, 2)).to(from.dtype());
  return {rotation, (to_centre - torch::bmm(from_centre, rotation.transpose(1, 2))).squeeze(1)};
}

RigidModuleImpl::RigidModuleImpl()
    : source_encoder_(register_module("source_encoder", Encoder(stack(3, kEncoderWidths)))),
      target_encoder_(register_module("target_encoder", Encoder(stack(3, kEncoderWidths)))),
      decoder_(register_module("decoder",
                               Perceptron(stack(2 * kFeatureSize, kRigidDecoderWidths), true))) {}

Pose RigidModuleImpl::forward(const torch::Tensor& moved_source, const torch::Tensor& target,
                              torch::Tensor& target_feature) {
  if (!target_feature.defined()) target_feature = target_encoder_->forward(target);
  const auto source_feature = source_encoder_->forward(moved_source);
  const auto output = decoder_->forward(torch::cat({source_feature, target_feature}, 1));
  return {rotationOf(output.slice(1, 0, 4)), output.slice(1, 4, 7)};
}

NonRigidModuleImpl::NonRigidModuleImpl(Pairing pairing)
    : pairing_(pairing),
      source_encoder_(register_module("source_encoder", Encoder(stack(3, kEncoderWidths)))),
      target_encoder_(register_module("target_encoder", Encoder(stack(3, kEncoderWidths)))),
      decoder_(register_module(
          "decoder",
          Perceptron(stack(nonRigidDecoderInputs(pairing), kNonRigidDecoderWidths), true))) {}

torch::Tensor NonRigidModuleImpl::forward(const torch::Tensor& moved_source,
                                          const torch::Tensor& target,
                                          c10::optional<std::int64_t> points) {
  const auto features =
      torch::cat({source_encoder_->forward(moved_source), target_encoder_->forward(target)}, 1);
  torch::Tensor local = moved_source;  // what the decoder reads of each point
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

FlowModuleImpl::FlowModuleImpl()
    : source_encoder_(
          register_module("source_encoder", Encoder(stack(kFlowInputs, kFlowEncoderWidths)))),
      target_encoder_(
          register_module("target_encoder", Encoder(stack(kFlowTargetInputs, kFlowEncoderWidths)))),
      decoder_(register_module(
          "decoder",
          Perceptron(stack(kFlowInputs + 2 * kFlowFeatureSize, kFlowDecoderWidths), true))) {}

torch::Tensor FlowModuleImpl::forward(const torch::Tensor& start, const torch::Tensor& reached,
                                      const torch::Tensor& target) {
  const auto deformation = reached - bestRigidFit(start, reached).apply(start);
  const Surroundings read = surroundings(reached, deformation, target);
  const auto features = torch::cat(
      {source_encoder_->forward(read.of_source), target_encoder_->forward(read.of_target)}, 1);
  const auto first = decoder_->layer(0);
  const auto columns = first->weight.split_with_sizes({kFlowInputs, 2 * kFlowFeatureSize}, 1);
  const auto global = torch::linear(features, columns[1], first->bias);
  const auto output =
      decoder_->continueFrom(torch::linear(read.of_source, columns[0]) + global.unsqueeze(1));
  const auto vectors =
      read.of_source.slice(2, kFlowFirstVector, kFlowFirstVector + 3 * kFlowVectors)
          .unflatten(2, {kFlowVectors, 3});
  return output.slice(2, 0, 3) + (output.slice(2, 3).unsqueeze(3) * vectors).sum(2);
}

torch::Tensor coarseOrder(const torch::Tensor& points) {
  const auto places = evenlyChosen(points.size(1), kFlowCoarsePoints, points.device());
  return points.select(2, 0).argsort(1, false).index_select(1, places);
}

torch::Tensor ordered(const torch::Tensor& points, const torch::Tensor& order) {
  return points.gather(1, order.unsqueeze(2).expand({-1, -1, 3}));
}

UniritImpl::UniritImpl(Pairing pairing) : pairing_(pairing) {
  if (pairing == Pairing::kOffsets) {
    flow = register_module("flow", FlowModule());
  } else {
    rigid = register_module("rigid", RigidModule());
    nonrigid = register_module("nonrigid", NonRigidModule(pairing));
  }
}

torch::Tensor UniritImpl::moveRigidly(const torch::Tensor& source, const torch::Tensor& target,
                                      int iterations) {
  torch::Tensor moved = source, target_feature;
  if (!flow) {
    for (int i = 0; i < iterations; ++i) {
      moved = rigid->forward(moved, target, target_feature).apply(moved);
    }
    return moved;
  }
  const torch::Tensor some_of_target = ordered(target, coarseOrder(target));
  torch::Tensor some = ordered(source, coarseOrder(source));
  torch::Tensor going_on = torch::ones({source.size(0), 1, 1}, source.options()).to(torch::kBool);
  for (int i = 0; i + 1 < iterations; ++i) {
    const Pose step = bestRigidFit(some, followFlow(some, some_of_target, kFlowCoarseSteps));
    const auto reached = step.apply(some);
    const auto motion = (reached - some).square().sum(2, true).mean(1, true).sqrt();
    moved = torch::where(going_on, step.apply(moved), moved);
    some = torch::where(going_on, reached, some);
    going_on = going_on & (motion >= kFlowConverged);
  }
  if (iterations == 0) return moved;
  return bestRigidFit(moved, followFlow(moved, sorted(target), kFlowFineSteps)).apply(moved);
}

torch::Tensor UniritImpl::deform(const torch::Tensor& moved_source, const torch::Tensor& target) {
  if (flow) return followFlow(moved_source, sorted(target), kFlowNonRigidSteps);
  return moved_source + nonrigid->forward(moved_source, target);
}

torch::Tensor UniritImpl::followFlow(const torch::Tensor& source, const torch::Tensor& target,
                                     int steps) {
  torch::Tensor reached = source;
  for (int i = 0; i < steps; ++i) reached = reached + flow->forward(source, reached, target);
  return reached;
}

void UniritImpl::setWeights(const Weights& weights) {
  if (weights.pairing != pairing_) {
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
    parameters[shape.name + ".weight"].copy_(
        torch::from_blob(weight.data(), {shape.outputs, shape.inputs}));
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

}  // namespace unirit::training
