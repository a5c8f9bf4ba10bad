// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "unirit/evaluation/pair_set.hpp"

namespace unirit {

using StoredPose = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

inline constexpr char kPairSetFormat[] = "unirit-pairs";
inline constexpr char kPairSetVersion[] = "1";

/// Tensors that every protocol of a set shares, [cases, points, 3].
struct SharedTensor {
  const char* name;
  Points DeformedPoints::*points;
};
inline constexpr SharedTensor kSharedTensors[] = {
    {"source", &DeformedPoints::source},
    {"source_normals", &DeformedPoints::source_normals},
    {"truth", &DeformedPoints::truth},
    {"interior", &DeformedPoints::interior},
    {"interior_truth", &DeformedPoints::interior_truth},
    {"surface", &DeformedPoints::surface}};

}  // namespace unirit
