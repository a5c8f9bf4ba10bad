// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "dense_layer.hpp"
#include "nearest_offsets.hpp"
#include "unirit/point_cloud.hpp"

namespace unirit {

/// Point encoder: a stack of layers for each point, then the maximum over the points.
class Encoder {
 public:
  Encoder(const Kernels& kernels, const Weights& weights, const std::string& name);

  /// Writes the featureSize() numbers of the cloud's feature. `offsets`, to the other cloud, are
  /// given where the encoder reads them, else null. The last layer's outputs are never stored: each
  /// block of points only raises the maxima, which a ReLU starts at zero.
  void encode(const Points& points, const NearestOffsets* offsets, float* feature,
              Workspace& workspace) const;

  int featureSize() const { return feature_size_; }

 private:
  int feature_size_;
  std::vector<DenseLayer> layers_;  ///< all but the last
  DenseLayer last_;
};

}  // namespace unirit
