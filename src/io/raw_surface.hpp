// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace unirit {

/// What stands in a surface file: its unit, its invalid points, its indices unchecked.
struct RawSurface {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3d> normals;  // one a point, or none
  std::vector<std::array<double, 3>> faces;
  std::optional<Eigen::Vector3d> viewpoint;

  /// Splits a polygon into a fan of triangles; throws std::runtime_error on fewer than 3 corners.
  void addPolygon(const std::vector<double>& corners);
};

/// Parsers of whole files. They throw std::runtime_error saying what is wrong, without the name.
RawSurface parsePly(std::string_view file);
RawSurface parsePcd(std::string_view file);
RawSurface parseStl(std::string_view file);
RawSurface parseObj(std::string_view file);

/// Where coordinates and normals stand among the named columns of a PLY or PCD vertex.
class VertexColumns {
 public:
  /// Throws std::runtime_error where x, y or z is missing.
  explicit VertexColumns(const std::vector<std::string>& names);
  void append(const std::vector<double>& row, RawSurface& surface) const;

 private:
  std::array<std::size_t, 3> point_{};
  std::optional<std::array<std::size_t, 3>> normal_;
};

}  // namespace unirit
