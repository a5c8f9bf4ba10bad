// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace unirit {

/// Points, directions or displacements, one a column (3 x N). Metres unless said otherwise.
using Points = Eigen::Matrix3Xf;

/// A cloud as the core sees it: finite points, and normals where they are known.
struct PointCloud {
  Points points;   ///< 3 x N [m]
  Points normals;  ///< 3 x N unit vectors, or empty where unknown
  std::optional<Eigen::Vector3f> viewpoint = std::nullopt;  ///< where the sensor stood, if known

  Eigen::Index size() const { return points.cols(); }
};

/// A triangle mesh, or a bare cloud where `faces` is empty.
struct Surface {
  PointCloud vertices;
  Eigen::Matrix3Xi faces;  ///< 3 x F indices into the vertices, counter-clockwise seen from outside
};

/// Mean of the points; sums in double precision. Throws std::invalid_argument on an empty cloud.
Eigen::Vector3f centroid(const Points& points);

/// The points, moved rigidly; computed in double precision.
Points moved(const Eigen::Isometry3d& pose, const Points& points);

/// Twice the largest absolute coordinate about the centroid [m]: the length every limit scales
/// with.
double extent(const Points& points);

}  // namespace unirit
