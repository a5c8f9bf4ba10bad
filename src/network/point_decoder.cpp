// SPDX-License-Identifier: BSD-3-Clause
#include "point_decoder.hpp"

namespace unirit {
namespace {

/// All columns but those of the features; no bias.
Layer pointColumns(const Layer& layer, long first_feature, long feature_count) {
  const Eigen::Index rest = layer.weight.cols() - first_feature - feature_count;
  Eigen::MatrixXf weight(layer.weight.rows(), first_feature + rest);
  weight << layer.weight.leftCols(first_feature), layer.weight.rightCols(rest);
  return {weight, Eigen::VectorXf::Zero(layer.bias.size())};
}

}  // namespace

PointDecoder::PointDecoder(const Kernels& kernels, const Weights& weights, const std::string& name,
                           int layers, long first_feature, long feature_count)
    : point_layer_(kernels,
                   pointColumns(weights.layers.at(name + ".0"), first_feature, feature_count),
                   Activation::kRelu),
      feature_layer_(
          kernels,
          {weights.layers.at(name + ".0").weight.middleCols(first_feature, feature_count),
           weights.layers.at(name + ".0").bias},
          Activation::kNone),
      layers_(packLayers(kernels, weights, name, 1, layers - 1, Activation::kNone)),
      feature_outputs_(feature_layer_.paddedOutputs()) {}

}  // namespace unirit
