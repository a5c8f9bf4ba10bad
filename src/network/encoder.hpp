// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "dense_layer.hpp"

namespace unirit {

/// Point encoder: a stack of layers for each point, then the maximum over the points.
class Encoder {
 public:
  Encoder(const Kernels& kernels, const Weights& weights, const std::string& name);

  /// Writes the numbers of a cloud's feature, of a row for each of its points. The
  /// last layer's outputs are never stored: each block of points only raises the maxima, which a
  /// ReLU starts at zero.
  void encode(const RowsView& points, float* feature, Workspace& workspace) const;

 private:
  int feature_size_;
  std::vector<DenseLayer> layers_;  ///< all but the last
  DenseLayer last_;
};

}  // namespace unirit
