// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <functional>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// A smooth function of space: negative inside a solid, about the distance to it near its surface.
using Solid = std::function<double(const Eigen::Vector3d&)>;

/// The surface of `solid` within `box`, closed where the solid does not reach the box's sides, with
/// outward faces. Marching tetrahedra (Doi and Koide 1991) on a grid of the given spacing.
Surface cutOut(const Solid& solid, const Eigen::AlignedBox3d& box, double spacing);

/// Moves the vertices of such a surface along it until their triangles are of even size, and gives
/// them outward normals.
void evenOut(const Solid& solid, Surface& surface);

}  // namespace unirit
