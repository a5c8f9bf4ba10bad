// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/surface_io.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <new>
#include <stdexcept>

#include "raw_surface.hpp"
#include "scalar_stream.hpp"

namespace unirit {
namespace {

using Parser = RawSurface (*)(std::string_view);

Parser parserFor(const std::string& path) {
  static const std::map<std::string, Parser> parsers{
      {".ply", parsePly}, {".pcd", parsePcd}, {".stl", parseStl}, {".obj", parseObj}};
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const auto found = parsers.find(extension);
  if (found == parsers.end()) {
    throw std::runtime_error("its extension is none of .ply, .pcd, .stl, .obj");
  }
  return found->second;
}

std::string readBytes(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw std::runtime_error("it is a directory");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(std::strerror(errno));
  return {std::istreambuf_iterator<char>(file), {}};
}

// New index of each point that is finite and representable, -1 of others.
std::vector<int> numberFinite(const std::vector<Eigen::Vector3d>& points, double unit) {
  std::vector<int> indices;
  int count = 0;
  for (const auto& point : points) {
    const Eigen::Vector3f metres = (unit * point).cast<float>();
    indices.push_back(metres.allFinite() ? count++ : -1);
  }
  return indices;
}

// Normals are known for all points or for none.
Points unitNormals(const RawSurface& raw, const std::vector<int>& indices, Eigen::Index count) {
  if (raw.normals.empty()) return {};
  Points normals(3, count);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] < 0) continue;
    const double length = raw.normals[i].norm();
    if (!std::isfinite(length) || length < 1e-6) return {};
    normals.col(indices[i]) = (raw.normals[i] / length).cast<float>();
  }
  return normals;
}

Eigen::Matrix3Xi keptFaces(const RawSurface& raw, const std::vector<int>& indices) {
  Eigen::Matrix3Xi faces(3, raw.faces.size());
  Eigen::Index count = 0;
  for (const auto& face : raw.faces) {
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) {
      const double corner = face[k];
      if (!(corner >= 0 && corner < static_cast<double>(indices.size()))) {
        throw std::runtime_error("a face refers to a vertex that does not exist");
      }
      corners[k] = indices[static_cast<std::size_t>(corner)];
    }
    if (corners.minCoeff() >= 0) faces.col(count++) = corners;
  }
  return faces.leftCols(count);
}

SurfaceFile toMetres(const RawSurface& raw, double unit) {
  const std::vector<int> indices = numberFinite(raw.points, unit);
  const auto count = std::count_if(indices.begin(), indices.end(), [](int i) { return i >= 0; });
  if (count == 0) throw std::runtime_error("it holds no finite point");
  SurfaceFile file;
  file.surface.vertices.points.resize(3, count);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    if (indices[i] >= 0) {
      file.surface.vertices.points.col(indices[i]) = (unit * raw.points[i]).cast<float>();
    }
  }
  file.surface.vertices.normals = unitNormals(raw, indices, count);
  file.surface.faces = keptFaces(raw, indices);
  if (raw.viewpoint) file.viewpoint = (unit * *raw.viewpoint).cast<float>();
  file.dropped = static_cast<Eigen::Index>(indices.size()) - count;
  return file;
}

template <class Number>
void append(std::string& bytes, const Number* numbers, Eigen::Index count) {
  bytes.append(reinterpret_cast<const char*>(numbers), sizeof(Number) * count);
}

std::string plyHeader(const Surface& surface, bool with_normals) {
  const std::string order = kHostEncoding == Encoding::kBigEndian ? "big" : "little";
  std::string header = "ply\nformat binary_" + order + "_endian 1.0\nelement vertex " +
                       std::to_string(surface.vertices.size()) + "\n";
  for (const char* name : {"x", "y", "z"}) header += std::string("property float ") + name + "\n";
  if (with_normals) header += "property float nx\nproperty float ny\nproperty float nz\n";
  if (surface.faces.cols() > 0) {
    header += "element face " + std::to_string(surface.faces.cols()) +
              "\nproperty list uchar int vertex_indices\n";
  }
  return header + "end_header\n";
}

}  // namespace

SurfaceFile readSurface(const std::string& path, double unit) {
  if (!(unit > 0.0 && std::isfinite(unit))) {
    throw std::invalid_argument("readSurface: unit must be positive");
  }
  try {
    return toMetres(parserFor(path)(readBytes(path)), unit);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error("Cannot read \"" + path + "\": " + error.what() + ".");
  } catch (const std::bad_alloc&) {
    throw std::runtime_error("Cannot read \"" + path + "\": it does not fit in memory.");
  }
}

void writePly(const Surface& surface, const std::string& path, double unit) {
  const bool with_normals = surface.vertices.normals.cols() == surface.vertices.size();
  const Points points = surface.vertices.points / static_cast<float>(unit);
  std::string bytes = plyHeader(surface, with_normals);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    append(bytes, points.col(i).data(), 3);
    if (with_normals) append(bytes, surface.vertices.normals.col(i).data(), 3);
  }
  for (Eigen::Index i = 0; i < surface.faces.cols(); ++i) {
    bytes += '\3';
    append(bytes, surface.faces.col(i).data(), 3);
  }
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file)
    throw std::runtime_error("Cannot write \"" + path + "\": " + std::strerror(errno) + ".");
}

}  // namespace unirit
