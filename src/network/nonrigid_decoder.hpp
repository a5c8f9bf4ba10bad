// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dense_layer.hpp"
#include "nearest_offsets.hpp"
#include "unirit/point_cloud.hpp"

namespace unirit {

/// Displacement of single points given the clouds' features. The first layer is linear, so its 2048
/// columns of features are multiplied once a pair and serve as the bias of the points' own columns.
class NonRigidDecoder {
 public:
  NonRigidDecoder(const Kernels& kernels, const Weights& weights);

  /// `features`: 2 x kFeatureSize; `to_target` is null where the pairing is none or row;
  /// `displacements` gets the size of `queries`.
  void decode(const float* features, const Points& target, const NearestOffsets* to_target,
              const Points& queries, Points& displacements, Workspace& workspace);

 private:
  RowsView pairedInputs(const Points& queries, long begin, long count, const Points& target,
                        const NearestOffsets* to_target, Scratch& scratch,
                        const Kernels& kernels) const;

  Pairing pairing_;
  DenseLayer point_layer_;          ///< the first layer's columns of the point and its paired row
  DenseLayer feature_layer_;        ///< its columns of the features
  std::vector<DenseLayer> layers_;  ///< those that follow
  AlignedFloats feature_outputs_;
};

}  // namespace unirit
