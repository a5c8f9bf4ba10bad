// SPDX-License-Identifier: BSD-3-Clause
#include "nonrigid_decoder.hpp"

#include <algorithm>

namespace unirit {
namespace {

constexpr int kLastLayer = static_cast<int>(kNonRigidDecoderHiddenWidths.size()) - 1;
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

void NonRigidDecoder::decode(const float* features, const Points& target, const Points& queries,
                             Points& displacements, Workspace& workspace) {
  feature_layer_.applyToRow(features, feature_outputs_.data(), workspace);
  if (pairing_ == Pairing::kNearest) {
    // Among targets equally near the first wins: sorted, that does not depend on their order.
    sorted_target_.resize(static_cast<std::size_t>(target.cols()));
    for (Eigen::Index i = 0; i < target.cols(); ++i) {
      sorted_target_[static_cast<std::size_t>(i)] = {target(0, i), target(1, i), target(2, i)};
    }
    std::sort(sorted_target_.begin(), sorted_target_.end());
  }
  displacements.resize(3, queries.cols());

  const Kernels& kernels = workspace.kernels();
  LayerView first = point_layer_.view();
  first.bias = feature_outputs_.data();
  workspace.forEachBlock(queries.cols(), [&](Scratch& scratch, long begin, long count) {
    const RowsView inputs = pairedInputs(queries, begin, count, target, scratch, kernels);
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
                                       const Points& target, Scratch& scratch,
                                       const Kernels& kernels) const {
  const float* points = queries.data() + 3 * begin;
  if (pairing_ == Pairing::kNone) {
    return {points, 3, count};
  }
  if (pairing_ == Pairing::kNearest) {
    kernels.nearest(points, count, sorted_target_.front().data(), target.cols(),
                    scratch.nearest.data());
  }
  Eigen::Map<Eigen::Matrix<float, 6, Eigen::Dynamic>> inputs(scratch.inputs.data(), 6, count);
  for (long i = 0; i < count; ++i) {
    const auto query = queries.col(begin + i);
    inputs.col(i).head<3>() = query;
    if (pairing_ == Pairing::kRow) {
      inputs.col(i).tail<3>() = target.col(begin + i);
    } else {
      const auto& nearest = sorted_target_[static_cast<std::size_t>(scratch.nearest[i])];
      inputs.col(i).tail<3>() = Eigen::Map<const Eigen::Vector3f>(nearest.data()) - query;
    }
  }
  return {scratch.inputs.data(), 6, count};
}

}  // namespace unirit
