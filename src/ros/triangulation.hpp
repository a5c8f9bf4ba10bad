// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "unirit/point_cloud.hpp"

namespace unirit {

/// Faces over the points of a surface that has none, in no particular sense of rotation: greedy
/// projection triangulation (Marton et al. 2009, PCL's). 3 x F. Small holes may be left.
Eigen::Matrix3Xi triangulate(const Points& points);

}  // namespace unirit
