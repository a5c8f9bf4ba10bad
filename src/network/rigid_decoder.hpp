// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "dense_layer.hpp"

namespace unirit {

/// A step of the rigid stage: p becomes rotation * p + translation.
struct RigidStep {
  Eigen::Quaternionf rotation;
  Eigen::Vector3f translation;
  bool converged = false;  ///< one more is enough
};

/// Reads a step off the features of the moved source and the target.
class RigidDecoder {
 public:
  RigidDecoder(const Kernels& kernels, const Weights& weights);

  /// `features`: of the source, then of the target. Throws std::runtime_error where the quaternion
  /// cannot be normalised.
  RigidStep decode(const float* features, Workspace& workspace);

 private:
  std::vector<DenseLayer> layers_;
  AlignedFloats outputs_[2];
};

}  // namespace unirit
