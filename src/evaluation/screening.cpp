// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/screening.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <numeric>
#include <utility>
#include <vector>

namespace unirit {
namespace {

/// Sets of vertices that belong together.
class Pieces {
 public:
  explicit Pieces(Eigen::Index count) : parents_(static_cast<std::size_t>(count)) {
    std::iota(parents_.begin(), parents_.end(), 0);
  }
  int find(int vertex) {
    while (parent(vertex) != vertex) vertex = parent(vertex) = parent(parent(vertex));
    return vertex;
  }
  void join(int a, int b) { parent(find(a)) = find(b); }

 private:
  int& parent(int vertex) { return parents_[static_cast<std::size_t>(vertex)]; }

  std::vector<int> parents_;
};

double area(const Points& points, const Eigen::Vector3i& face) {
  const Eigen::Vector3d a = points.col(face[0]).cast<double>();
  const Eigen::Vector3d b = points.col(face[1]).cast<double>();
  const Eigen::Vector3d c = points.col(face[2]).cast<double>();
  return (b - a).cross(c - a).norm() / 2.0;
}

/// Edges that belong to one face alone, in that face's direction.
std::vector<std::pair<int, int>> openEdges(const Eigen::Matrix3Xi& faces) {
  struct Edge {
    std::pair<int, int> key;
    std::pair<int, int> directed;
  };
  std::vector<Edge> edges;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int from = faces(k, f), to = faces((k + 1) % 3, f);
      edges.push_back({std::minmax({from, to}), {from, to}});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.key < b.key; });
  std::vector<std::pair<int, int>> open;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const bool same_before = i > 0 && edges[i - 1].key == edges[i].key;
    const bool same_after = i + 1 < edges.size() && edges[i + 1].key == edges[i].key;
    if (!same_before && !same_after) open.push_back(edges[i].directed);
  }
  return open;
}

/// A loop's vector area is that of the flattest surface it could bound, whatever the origin.
double areaOfHoles(const Points& points, const Eigen::Matrix3Xi& faces) {
  const auto open = openEdges(faces);
  Pieces loops(points.cols());
  for (const auto& [from, to] : open) loops.join(from, to);
  std::map<int, Eigen::Vector3d> areas;
  for (const auto& [from, to] : open) {
    const int loop = loops.find(from);
    const Eigen::Vector3d origin = points.col(loop).cast<double>();
    const Eigen::Vector3d a = points.col(from).cast<double>() - origin;
    const Eigen::Vector3d b = points.col(to).cast<double>() - origin;
    areas.try_emplace(loop, Eigen::Vector3d::Zero()).first->second += a.cross(b) / 2.0;
  }
  double sum = 0.0;
  for (const auto& [loop, vector_area] : areas) sum += vector_area.norm();
  return sum;
}

double lengthOf(const Points& points) {
  Eigen::Index far = 0;
  (points.colwise() - centroid(points)).colwise().squaredNorm().maxCoeff(&far);
  double length = 0.0;
  for (int sweep = 0; sweep < 3; ++sweep) {
    const Eigen::Vector3f from = points.col(far);
    length = std::sqrt((points.colwise() - from).colwise().squaredNorm().maxCoeff(&far));
  }
  return length;
}

template <class... Values>
std::string format(const char* pattern, Values... values) {
  char text[200];
  std::snprintf(text, sizeof(text), pattern, values...);
  return text;
}

}  // namespace

SurfaceMeasures measureSurface(const Surface& surface) {
  const Points& points = surface.vertices.points;
  SurfaceMeasures measures;
  measures.faces = surface.faces.cols();
  if (measures.faces == 0) return measures;
  measures.length = lengthOf(points);

  Pieces pieces(points.cols());
  for (Eigen::Index f = 0; f < measures.faces; ++f) {
    pieces.join(surface.faces(0, f), surface.faces(1, f));
    pieces.join(surface.faces(0, f), surface.faces(2, f));
  }
  std::map<int, double> areas;
  double total = 0.0, largest = 0.0;
  for (Eigen::Index f = 0; f < measures.faces; ++f) {
    const double part = area(points, surface.faces.col(f));
    total += part;
    largest = std::max(largest, areas[pieces.find(surface.faces(0, f))] += part);
  }
  if (total > 0.0) {
    measures.main_piece = largest / total;
    measures.open_share = areaOfHoles(points, surface.faces) / total;
  }
  return measures;
}

std::map<std::string, LengthRange> ScreeningLimits::plausibleLengths() {
  return {{"liver", {0.13, 0.38}},   {"kidney", {0.06, 0.20}},      {"kidney_tumor", {0.07, 0.32}},
          {"brain", {0.12, 0.23}},   {"brain_tumor", {0.12, 0.23}}, {"gallbladder", {0.03, 0.18}},
          {"stomach", {0.08, 0.38}}, {"pancreas", {0.07, 0.28}},    {"spleen", {0.06, 0.30}},
          {"atrium", {0.045, 0.15}}, {"small_bowel", {0.12, 0.60}}};
}

std::string rejectionReason(const Surface& surface, const std::string& organ,
                            const ScreeningLimits& limits) {
  const SurfaceMeasures measures = measureSurface(surface);
  const auto found = limits.lengths.find(organ);
  const LengthRange range = found == limits.lengths.end() ? limits.other_length : found->second;
  if (measures.faces < limits.min_faces) {
    return format("has %ld faces, fewer than %ld", static_cast<long>(measures.faces),
                  static_cast<long>(limits.min_faces));
  }
  if (measures.main_piece == 0.0) return "has no face with an area";
  if (!(measures.main_piece >= limits.min_main_piece)) {
    return format("is in pieces: the largest has %.0f %% of the surface, less than %.0f %%",
                  100.0 * measures.main_piece, 100.0 * limits.min_main_piece);
  }
  if (measures.open_share > limits.max_open_share) {
    return format("is open: its holes have %.0f %% of the surface's area, more than %.0f %%",
                  100.0 * measures.open_share, 100.0 * limits.max_open_share);
  }
  if (!(measures.length >= range.least && measures.length <= range.most)) {
    return format("is %.4g mm long, which is not plausible for %s (%.4g to %.4g mm)",
                  1000.0 * measures.length, organ.c_str(), 1000.0 * range.least,
                  1000.0 * range.most);
  }
  return {};
}

}  // namespace unirit
