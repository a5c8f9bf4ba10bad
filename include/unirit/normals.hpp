// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "unirit/point_cloud.hpp"

namespace unirit {

/// Unit normals of a surface's samples, 3 x N, of arbitrary sign: the direction in which the 14
/// nearest points vary least (Hoppe et al. 1992). Throws std::invalid_argument where there are
/// fewer than 3 points.
Points estimateNormals(const Points& points);

/// Reverses all faces of a closed mesh that has them inside out: its signed volume is negative.
void turnFacesOutwards(Surface& mesh);

/// Unit normals of a mesh's vertices, 3 x N: the mean of the normals of the faces around each, by
/// area. Zero where a vertex has no face with an area.
Points vertexNormals(const Surface& mesh);

/// Turns the normals to the same side of the surface as their neighbours', along the neighbours
/// that agree best (Hoppe et al. 1992), and away from the centroid on the whole: outwards where the
/// surface is closed, and on the convex side of a part of it. Piece by piece where there are
/// several.
void orientOutwards(const Points& points, Points& normals);

/// estimateNormals, then orientOutwards; the nearest points are sought only once.
Points outwardNormals(const Points& points);

/// Turns every normal to the half space of the viewpoint (same frame and unit as the points).
void orientTowards(const Points& points, const Eigen::Vector3f& viewpoint, Points& normals);

/// Length of the mean normal, in [0, 1]. Zero for evenly sampled closed surfaces, whose oriented
/// areas cancel, 0.5 for a half sphere: tells a whole surface from a view of one side.
double openness(const Points& normals);

}  // namespace unirit
