// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "dense_layer.hpp"

namespace unirit {

/// Outputs for single points given the clouds' features. The first layer is linear, so its columns
/// of features are multiplied once a pair and serve as the bias of the points' own columns.
class PointDecoder {
 public:
  /// Of `layers` layers, NAME.0 and on; the features' columns of the first are `feature_count` from
  /// `first_feature` on.
  PointDecoder(const Kernels& kernels, const Weights& weights, const std::string& name, int layers,
               long first_feature, long feature_count);

  /// Calls read(scratch, begin, count) for the rows of each block of points, which may stand in
  /// scratch.inputs, and write(begin, outputs) with what the last layer makes of them.
  template <class Read, class Write>
  void decode(const float* features, long count, Workspace& workspace, const Read& read,
              const Write& write) {
    feature_layer_.applyToRow(features, feature_outputs_.data(), workspace);
    const Kernels& kernels = workspace.kernels();
    LayerView first = point_layer_.view();
    first.bias = feature_outputs_.data();
    workspace.forEachBlock(count, [&](Scratch& scratch, long begin, long rows) {
      float* hidden = scratch.activations[0].data();
      kernels.dense(first, read(scratch, begin, rows), 0, first.panel_count, hidden, kBlockStride);
      write(begin, runLayers(kernels, layers_, {hidden, kBlockStride, rows}, scratch));
    });
  }

 private:
  DenseLayer point_layer_;          ///< the first layer's columns of the point
  DenseLayer feature_layer_;        ///< its columns of the features
  std::vector<DenseLayer> layers_;  ///< those that follow
  AlignedFloats feature_outputs_;
};

}  // namespace unirit
