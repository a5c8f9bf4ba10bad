// SPDX-License-Identifier: BSD-3-Clause
#include "dense_layer.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace unirit {
namespace {

// Multiplying a row with fewer weights than this takes no longer than waking a thread
constexpr long kItemWeights = 1L << 19;

}  // namespace

DenseLayer::DenseLayer(const Kernels& kernels, const Layer& layer, Activation activation)
    : width_(kernels.panel_width) {
  const long inputs = layer.weight.cols();
  const long outputs = layer.weight.rows();
  const long panel_count = (outputs + width_ - 1) / width_;
  panels_ = AlignedFloats(static_cast<std::size_t>(panel_count * inputs * width_));
  bias_ = AlignedFloats(static_cast<std::size_t>(panel_count * width_));
  for (long input = 0; input < inputs; ++input) {
    for (long output = 0; output < outputs; ++output) {
      const long panel = output / width_;
      panels_.data()[(panel * inputs + input) * width_ + output % width_] =
          layer.weight(output, input);
    }
  }
  std::copy_n(layer.bias.data(), layer.bias.size(), bias_.data());
  const float floor =
      activation == Activation::kRelu ? 0.0F : -std::numeric_limits<float>::infinity();
  view_ = {panels_.data(), bias_.data(), floor, inputs, panel_count};
}

std::size_t DenseLayer::paddedOutputs() const {
  return static_cast<std::size_t>(view_.panel_count * width_);
}

void DenseLayer::applyToRow(const float* input, float* output, Workspace& workspace) const {
  const long panels_per_item =
      std::clamp(kItemWeights / (width_ * view_.inputs), 1L, view_.panel_count);
  const long items = (view_.panel_count + panels_per_item - 1) / panels_per_item;
  workspace.team().forEach(items, [&](int, long item) {
    const long first = item * panels_per_item;
    const long end = std::min(first + panels_per_item, view_.panel_count);
    workspace.kernels().dense(view_, {input, 0, 1}, first, end, output, 0);
  });
}

std::vector<DenseLayer> packLayers(const Kernels& kernels, const Weights& weights,
                                   const std::string& name, int first, int last,
                                   Activation last_activation) {
  std::vector<DenseLayer> layers;
  for (int i = first; i <= last; ++i) {
    const Layer& layer = weights.layers.at(name + "." + std::to_string(i));
    layers.emplace_back(kernels, layer, i == last ? last_activation : Activation::kRelu);
  }
  return layers;
}

RowsView runLayers(const Kernels& kernels, const std::vector<DenseLayer>& layers, RowsView input,
                   Scratch& scratch) {
  float* output = scratch.activations[1].data();
  float* other = scratch.activations[0].data();
  for (const DenseLayer& layer : layers) {
    kernels.dense(layer.view(), input, 0, layer.view().panel_count, output, kBlockStride);
    input = {output, kBlockStride, input.count};
    std::swap(output, other);
  }
  return input;
}

}  // namespace unirit
