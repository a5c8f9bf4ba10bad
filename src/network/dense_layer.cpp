// SPDX-License-Identifier: BSD-3-Clause
#include "dense_layer.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace unirit {
namespace {

// Waking the threads costs more than reading fewer weights than this
constexpr long kParallelWeights = 1L << 20;

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
  std::copy(layer.bias.begin(), layer.bias.end(), bias_.data());
  const float floor =
      activation == Activation::kRelu ? 0.0F : -std::numeric_limits<float>::infinity();
  view_ = {panels_.data(), bias_.data(), floor, inputs, panel_count};
}

std::size_t DenseLayer::paddedOutputs() const {
  return static_cast<std::size_t>(view_.panel_count * width_);
}

void DenseLayer::applyToRow(const float* input, float* output, Workspace& workspace) const {
  const bool parallel = view_.panel_count * width_ * view_.inputs >= kParallelWeights;
#pragma omp parallel for num_threads(workspace.threads()) schedule(static) if (parallel)
  for (long panel = 0; panel < view_.panel_count; ++panel) {
    workspace.kernels().dense(view_, {input, 0, 1}, panel, panel + 1, output, 0);
  }
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
