// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// Names of the organs makePhantom knows: "liver", "kidney", "spleen", "gallbladder", ...
const std::vector<std::string>& phantomOrgans();

/// A digital phantom: a smooth closed organ-like mesh with lobes and notches, in metres, normals
/// outwards, about its own centroid. Another seed is another patient. Throws std::invalid_argument
/// naming an unknown organ or fewer than 500 vertices.
Surface makePhantom(const std::string& organ, std::uint64_t seed, int approximate_vertices = 10000);

}  // namespace unirit
