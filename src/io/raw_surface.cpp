// SPDX-License-Identifier: BSD-3-Clause
#include "raw_surface.hpp"

#include <algorithm>
#include <stdexcept>

namespace unirit {
namespace {

using Columns = std::array<std::size_t, 3>;

std::optional<Columns> find(const std::vector<std::string>& names,
                            const std::array<std::string, 3>& wanted) {
  Columns columns;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto found = std::find(names.begin(), names.end(), wanted[i]);
    if (found == names.end()) return std::nullopt;
    columns[i] = static_cast<std::size_t>(found - names.begin());
  }
  return columns;
}

Eigen::Vector3d pick(const std::vector<double>& row, const Columns& columns) {
  return {row[columns[0]], row[columns[1]], row[columns[2]]};
}

}  // namespace

void RawSurface::addPolygon(const std::vector<double>& corners) {
  if (corners.size() < 3) {
    throw std::runtime_error("a face has " + std::to_string(corners.size()) + " corners");
  }
  for (std::size_t i = 2; i < corners.size(); ++i) {
    faces.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

VertexColumns::VertexColumns(const std::vector<std::string>& names) {
  const auto point = find(names, {"x", "y", "z"});
  if (!point) throw std::runtime_error("its points lack x, y or z");
  point_ = *point;
  normal_ = find(names, {"nx", "ny", "nz"});
  if (!normal_) normal_ = find(names, {"normal_x", "normal_y", "normal_z"});
}

void VertexColumns::append(const std::vector<double>& row, RawSurface& surface) const {
  surface.points.push_back(pick(row, point_));
  if (normal_) surface.normals.push_back(pick(row, *normal_));
}

}  // namespace unirit
