// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <functional>
#include <stdexcept>
#include <unordered_map>

#include "raw_surface.hpp"
#include "scalar_stream.hpp"

namespace unirit {
namespace {

constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kFacetBytes = 50;

using Corner = std::array<double, 3>;

struct CornerHash {
  std::size_t operator()(const Corner& corner) const {
    char bytes[sizeof(Corner)];
    std::memcpy(bytes, corner.data(), sizeof(bytes));
    return std::hash<std::string_view>()({bytes, sizeof(bytes)});
  }
};

// STL repeats a vertex in each of its triangles; equal ones become one, so the mesh is connected.
class VertexMerger {
 public:
  explicit VertexMerger(RawSurface& surface) : surface_(surface) {}

  double indexOf(Corner corner) {
    for (double& coordinate : corner) coordinate += 0.0;  // -0 becomes 0
    const auto [entry, is_new] = indices_.try_emplace(corner, surface_.points.size());
    if (is_new) surface_.points.emplace_back(corner[0], corner[1], corner[2]);
    return static_cast<double>(entry->second);
  }

 private:
  RawSurface& surface_;
  std::unordered_map<Corner, std::size_t, CornerHash> indices_;
};

// Number of triangles that a binary file announces; none where the file is too short for that.
std::optional<std::size_t> facetCount(std::string_view file) {
  if (file.size() < kHeaderBytes + 4) return std::nullopt;
  ScalarStream stream(file.substr(kHeaderBytes), Encoding::kLittleEndian);
  return static_cast<std::size_t>(stream.next(ScalarType::kUInt32));
}

RawSurface parseBinary(std::string_view file) {
  const auto count = facetCount(file);
  if (!count || *count * kFacetBytes > file.size() - kHeaderBytes - 4) {
    throw std::runtime_error("it is shorter than its header says");
  }
  RawSurface surface;
  VertexMerger merger(surface);
  for (std::size_t i = 0; i < *count; ++i) {
    constexpr std::size_t kNormalBytes = 12;
    ScalarStream stream(file.substr(kHeaderBytes + 4 + i * kFacetBytes + kNormalBytes),
                        Encoding::kLittleEndian);
    std::vector<double> corners;
    for (int k = 0; k < 3; ++k) {
      Corner corner;
      for (double& coordinate : corner) coordinate = stream.next(ScalarType::kFloat32);
      corners.push_back(merger.indexOf(corner));
    }
    surface.addPolygon(corners);
  }
  return surface;
}

RawSurface parseText(std::string_view file) {
  RawSurface surface;
  VertexMerger merger(surface);
  std::vector<double> corners;
  std::string_view last;
  takeLine(file);  // "solid" and a free name
  for (auto word = takeWord(file); !word.empty(); word = takeWord(file)) {
    last = word;
    if (word == "vertex") {
      Corner corner;
      for (double& coordinate : corner) coordinate = toNumber(takeWord(file));
      corners.push_back(merger.indexOf(corner));
    } else if (word == "endfacet") {
      surface.addPolygon(corners);
      corners.clear();
    } else if (word == "solid" || word == "endsolid") {
      takeLine(file);
    }
  }
  if (last != "endsolid") throw std::runtime_error("it does not end with \"endsolid\"");
  return surface;
}

}  // namespace

RawSurface parseStl(std::string_view file) {
  // Some binary files begin with "solid" too; their size then tells.
  const auto count = facetCount(file);
  const bool binary_size = count && file.size() == kHeaderBytes + 4 + *count * kFacetBytes;
  return file.substr(0, 5) == "solid" && !binary_size ? parseText(file) : parseBinary(file);
}

}  // namespace unirit
