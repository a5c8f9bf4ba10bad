// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "aligned_floats.hpp"
#include "unirit/network/weights.hpp"
#include "workspace.hpp"

namespace unirit {

enum class Activation { kRelu, kNone };

/// A fully connected layer, its weights packed once into the panels the kernels read.
class DenseLayer {
 public:
  DenseLayer(const Kernels& kernels, const Layer& layer, Activation activation);

  const LayerView& view() const { return view_; }

  /// Outputs as the kernels write them: whole panels, zero past the layer's own.
  std::size_t paddedOutputs() const;

  /// Writes paddedOutputs() numbers: the layer applied to one row, spread over the threads.
  void applyToRow(const float* input, float* output, Workspace& workspace) const;

 private:
  long width_;
  AlignedFloats panels_;
  AlignedFloats bias_;
  LayerView view_{};
};

/// The layers NAME.FIRST to NAME.LAST of the weights; all but the last with a ReLU.
std::vector<DenseLayer> packLayers(const Kernels& kernels, const Weights& weights,
                                   const std::string& name, int first, int last,
                                   Activation last_activation);

/// Brings a block of rows through the layers. The result stands in the scratch's activations; the
/// input may stand in the first of them.
RowsView runLayers(const Kernels& kernels, const std::vector<DenseLayer>& layers, RowsView input,
                   Scratch& scratch);

}  // namespace unirit
