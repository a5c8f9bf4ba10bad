// SPDX-License-Identifier: BSD-3-Clause
#include "encoder.hpp"

#include <algorithm>

namespace unirit {
namespace {

constexpr int kLastLayer = static_cast<int>(kEncoderWidths.size()) - 1;
static_assert(kFlowEncoderWidths.size() == kEncoderWidths.size());

const Layer& lastLayer(const Weights& weights, const std::string& name) {
  return weights.layers.at(name + "." + std::to_string(kLastLayer));
}

}  // namespace

Encoder::Encoder(const Kernels& kernels, const Weights& weights, const std::string& name)
    : feature_size_(static_cast<int>(lastLayer(weights, name).bias.size())),
      layers_(packLayers(kernels, weights, name, 0, kLastLayer - 1, Activation::kRelu)),
      last_(kernels, lastLayer(weights, name), Activation::kRelu) {}

void Encoder::encode(const RowsView& points, float* feature, Workspace& workspace) const {
  for (Scratch& scratch : workspace.scratches()) {
    std::fill_n(scratch.maxima.data(), feature_size_, 0.0F);
  }
  const Kernels& kernels = workspace.kernels();
  workspace.forEachBlock(points.count, [&](Scratch& scratch, long begin, long count) {
    const RowsView input{points.data + points.stride * begin, points.stride, count};
    kernels.denseMaximum(last_.view(), runLayers(kernels, layers_, input, scratch),
                         scratch.maxima.data());
  });
  std::fill_n(feature, feature_size_, 0.0F);
  for (const Scratch& scratch : workspace.scratches()) {
    std::transform(feature, feature + feature_size_, scratch.maxima.data(), feature,
                   [](float a, float b) { return std::max(a, b); });
  }
}

}  // namespace unirit
