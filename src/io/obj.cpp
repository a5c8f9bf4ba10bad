// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "raw_surface.hpp"
#include "scalar_stream.hpp"

namespace unirit {
namespace {

Eigen::Vector3d pointFromLine(std::string_view line) {
  Eigen::Vector3d point;
  for (int axis = 0; axis < 3; ++axis) point[axis] = toNumber(takeWord(line));
  return point;
}

// Corners are "7", "7/2", "7/2/3" or "7//3", counted from 1, or backwards from the last vertex.
std::vector<double> cornersFromLine(std::string_view line, std::size_t vertices) {
  std::vector<double> corners;
  for (auto word = takeWord(line); !word.empty(); word = takeWord(line)) {
    const auto number = static_cast<double>(toInteger(word.substr(0, word.find('/'))));
    corners.push_back(number < 0 ? number + static_cast<double>(vertices) : number - 1);
  }
  return corners;
}

}  // namespace

RawSurface parseObj(std::string_view file) {
  RawSurface surface;
  for (int number = 1; !file.empty(); ++number) {
    std::string_view line = takeLine(file);
    try {
      const std::string_view keyword = takeWord(line);
      if (keyword == "v") surface.points.push_back(pointFromLine(line));
      if (keyword == "f") surface.addPolygon(cornersFromLine(line, surface.points.size()));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("in line " + std::to_string(number) + ", " + error.what());
    }
  }
  return surface;
}

}  // namespace unirit
