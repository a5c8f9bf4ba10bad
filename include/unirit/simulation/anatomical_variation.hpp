// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// How far a varied anatomy may be from the organ it was made from. Size and proportions are drawn
/// from log-normal distributions, cut off at twice their deviation.
struct AnatomicalVariation {
  double size = 0.06;         ///< deviation of the logarithm of the size (volume: three times that)
  double proportions = 0.05;  ///< same, of the length along each axis, volume kept
  double bend = 0.025;        ///< RMS of a smooth warp of space, over the extent, at most
};

/// Another patient's organ: the surface with another size, other proportions along the axes and a
/// smooth warp, a sum of waves not shorter than 0.8 of the extent. The warp's Lipschitz constant is
/// kept below 0.6, so that space cannot fold, neither at the surface nor inside. Faces stay, vertex
/// normals are dropped. Deterministic for a seed. Throws std::invalid_argument where the surface is
/// empty or a setting negative.
Surface varyAnatomy(const Surface& surface, std::uint64_t seed,
                    const AnatomicalVariation& variation = {});

}  // namespace unirit
