// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// Which of two points comes first by x, then y, then z: an order that is the points' own, whatever
/// that of their cloud.
bool lessByCoordinates(const Eigen::Vector3f& a, const Eigen::Vector3f& b);

/// At most `count` points spread evenly over the cloud, as columns' indices. Neither the chosen
/// points nor their sequence depends on the order of the cloud: dense clouds are first thinned to
/// one point a voxel, then farthest point sampling starts at the point farthest from the centroid.
/// Throws std::invalid_argument where count < 1.
std::vector<Eigen::Index> sampleEvenly(const Points& points, Eigen::Index count);

/// About `count` of the points, the same share of them everywhere, as columns' indices; all where
/// there are fewer. A point is drawn by its coordinates alone, in whatever order the cloud stands.
std::vector<Eigen::Index> drawByLot(const Points& points, Eigen::Index count);

/// `count` points on the triangles of a mesh, uniform by area, with face normals; deterministic
/// for a seed. Throws std::invalid_argument where the mesh has no face with an area.
PointCloud sampleByArea(const Surface& mesh, Eigen::Index count, std::uint64_t seed);

/// The columns of `points` at `indices`, in that sequence.
Points select(const Points& points, const std::vector<Eigen::Index>& indices);

}  // namespace unirit
