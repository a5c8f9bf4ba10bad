// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// A surface as read from a file.
struct SurfaceFile {
  Surface surface;                           ///< in metres, vertices in the file's order
  /// Where the sensor stood, if a PCD says so [m]. Not the origin: that is what writers put who know
  /// of no place.
  std::optional<Eigen::Vector3f> viewpoint;
  Eigen::Index dropped = 0;                  ///< points that were not finite (faces go with them)
};

/// Reads PLY, PCD, STL or OBJ (by extension, any case); meshes and bare clouds, ASCII and binary.
/// Polygons become triangles, equal vertices of an STL one vertex; further properties are skipped.
/// Normals are those of a PLY or PCD where every point has a valid one, else empty. `unit` is the
/// file's unit in metres (0.001 for millimetres). Throws std::runtime_error with a sentence naming
/// the file and what is wrong with it: missing, unknown extension, damaged, empty.
SurfaceFile readSurface(const std::string& path, double unit);

/// Writes a binary PLY in the given unit: vertices in their order, normals where present, faces.
/// Throws std::runtime_error naming the file where it cannot be written.
void writePly(const Surface& surface, const std::string& path, double unit);

}  // namespace unirit
