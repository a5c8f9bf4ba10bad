// SPDX-License-Identifier: BSD-3-Clause
#include "nonrigid_decoder.hpp"

namespace unirit {
namespace {

constexpr int kLastLayer = static_cast<int>(kNonRigidDecoderWidths.size()) - 1;
constexpr Eigen::Index kFeatureColumns = 2 * kFeatureSize;

const Layer& firstLayer(const Weights& weights) { return weights.layers.at("nonrigid.decoder.0"); }

/// The columns of the point and, where there is one, its paired row; no bias.
Layer pointColumns(const Layer& layer) {
  const Eigen::Index paired = layer.weight.cols() - 3 - kFeatureColumns;
  Eigen::MatrixXf weight(layer.weight.rows(), 3 + paired);
  weight << layer.weight.leftCols(3), layer.weight.rightCols(paired);
  return {weight, Eigen::VectorXf::Zero(layer.bias.size())};
}

Layer featureColumns(const Layer& layer) {
  return {layer.weight.middleCols(3, kFeatureColumns), layer.bias};
}

}  // namespace

NonRigidDecoder::NonRigidDecoder(const Kernels& kernels, const Weights& weights)
    : pairing_(weights.pairing),
      point_layer_(kernels, pointColumns(firstLayer(weights)), Activation::kRelu),
      feature_layer_(kernels, featureColumns(firstLayer(weights)), Activation::kNone),
      layers_(packLayers(kernels, weights, "nonrigid.decoder", 1, kLastLayer, Activation::kNone)),
      feature_outputs_(feature_layer_.paddedOutputs()) {}

void NonRigidDecoder::decode(const float* features, const Points& target,
                             const NearestOffsets* to_target, const Points& queries,
                             Points& displacements, Workspace& workspace) {
  feature_layer_.applyToRow(features, feature_outputs_.data(), workspace);
  displacements.resize(3, queries.cols());

  const Kernels& kernels = workspace.kernels();
  LayerView first = point_layer_.view();
  first.bias = feature_outputs_.data();
  workspace.forEachBlock(queries.cols(), [&](Scratch& scratch, long begin, long count) {
    const RowsView inputs =
        pairedInputs(queries, begin, count, target, to_target, scratch, kernels);
    float* hidden = scratch.activations[0].data();
    kernels.dense(first, inputs, 0, first.panel_count, hidden, kBlockStride);
    const RowsView outputs = runLayers(kernels, layers_, {hidden, kBlockStride, count}, scratch);
    for (long i = 0; i < count; ++i) {
      displacements.col(begin + i) =
          Eigen::Map<const Eigen::Vector3f>(outputs.data + i * outputs.stride);
    }
  });
}

RowsView NonRigidDecoder::pairedInputs(const Points& queries, long begin, long count,
                                       const Points& target, const NearestOffsets* to_target,
                                       Scratch& scratch, const Kernels& kernels) const {
  if (to_target != nullptr) {
    return to_target->rows(queries, begin, count, scratch, kernels);
  }
  if (pairing_ == Pairing::kNone) {
    return {queries.data() + 3 * begin, 3, count};
  }
  Eigen::Map<Eigen::Matrix<float, 6, Eigen::Dynamic>> inputs(scratch.inputs.data(), 6, count);
  inputs.topRows<3>() = queries.middleCols(begin, count);
  inputs.bottomRows<3>() = target.middleCols(begin, count);
  return {scratch.inputs.data(), 6, count};
}

}  // namespace unirit
