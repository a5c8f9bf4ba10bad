// SPDX-License-Identifier: BSD-3-Clause
#include "rigid_decoder.hpp"

#include <algorithm>
#include <stdexcept>

namespace unirit {
namespace {

constexpr float kMinNorm = 1e-12F;

}  // namespace

RigidDecoder::RigidDecoder(const Kernels& kernels, const Weights& weights)
    : layers_(packLayers(kernels, weights, "rigid.decoder", 0,
                         static_cast<int>(kRigidDecoderWidths.size()) - 1, Activation::kNone)) {
  std::size_t widest = 0;
  for (const DenseLayer& layer : layers_) {
    widest = std::max(widest, layer.paddedOutputs());
  }
  for (AlignedFloats& outputs : outputs_) {
    outputs = AlignedFloats(widest);
  }
}

RigidStep RigidDecoder::decode(const float* features, Workspace& workspace) {
  const float* input = features;
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    float* output = outputs_[i % 2].data();
    layers_[i].applyToRow(input, output, workspace);
    input = output;
  }
  const Eigen::Map<const Eigen::Matrix<float, 7, 1>> pose(input);  // w x y z, translation
  const float norm = pose.head<4>().norm();
  if (!pose.allFinite() || !(norm >= kMinNorm)) {
    throw std::runtime_error("the rigid module's output is not a rotation: its quaternion is (" +
                             std::to_string(pose[0]) + ", " + std::to_string(pose[1]) + ", " +
                             std::to_string(pose[2]) + ", " + std::to_string(pose[3]) + ")");
  }
  return {Eigen::Quaternionf(pose[0], pose[1], pose[2], pose[3]).normalized(), pose.tail<3>()};
}

}  // namespace unirit
