// SPDX-License-Identifier: BSD-3-Clause
#include "implicit_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <utility>
#include <vector>

namespace unirit {
namespace {

using Node = Eigen::Vector3i;

constexpr int kSmoothingSteps = 8;

// The cube cut into six tetrahedra round its main diagonal: one for each order of the axes. Cubes
// side by side share the cuts of their common face, so the surface has no gap.
std::array<std::array<Node, 4>, 6> tetrahedraOfCube() {
  std::array<std::array<Node, 4>, 6> tetrahedra;
  std::array<int, 3> axes{0, 1, 2};
  for (auto& tetrahedron : tetrahedra) {
    tetrahedron[0].setZero();
    for (int i = 0; i < 3; ++i) tetrahedron[i + 1] = tetrahedron[i] + Node::Unit(axes[i]);
    std::next_permutation(axes.begin(), axes.end());
  }
  return tetrahedra;
}

class MarchingTetrahedra {
 public:
  MarchingTetrahedra(const Solid& solid, const Eigen::AlignedBox3d& box, double spacing)
      : origin_(box.min()), spacing_(spacing) {
    nodes_ = (box.sizes() / spacing).array().ceil().cast<int>() + 1;
    values_.resize(static_cast<std::size_t>(nodes_[0]) * nodes_[1] * nodes_[2]);
    forEachNode(nodes_, [&](const Node& node) { values_[number(node)] = solid(place(node)); });
  }

  Surface run() {
    static const auto tetrahedra = tetrahedraOfCube();
    forEachNode(nodes_ - Node::Ones(), [&](const Node& node) {
      for (const auto& tetrahedron : tetrahedra) {
        cut({node + tetrahedron[0], node + tetrahedron[1], node + tetrahedron[2],
             node + tetrahedron[3]});
      }
    });
    Surface surface;
    surface.vertices.points = Eigen::Map<Points>(vertices_.front().data(), 3,
                                                 static_cast<Eigen::Index>(vertices_.size()));
    surface.faces = Eigen::Map<Eigen::Matrix3Xi>(faces_.front().data(), 3,
                                                 static_cast<Eigen::Index>(faces_.size()));
    return surface;
  }

 private:
  template <class Visitor>
  static void forEachNode(const Node& count, const Visitor& visit) {
    for (int z = 0; z < count[2]; ++z) {
      for (int y = 0; y < count[1]; ++y) {
        for (int x = 0; x < count[0]; ++x) visit(Node(x, y, z));
      }
    }
  }

  std::size_t number(const Node& node) const {
    return (static_cast<std::size_t>(node[2]) * nodes_[1] + node[1]) * nodes_[0] + node[0];
  }
  Eigen::Vector3d place(const Node& node) const { return origin_ + spacing_ * node.cast<double>(); }
  double value(const Node& node) const { return values_[number(node)]; }

  // The vertex between two nodes, kept away from both so that no triangle degenerates.
  int vertexBetween(const Node& a, const Node& b) {
    const std::size_t first = std::min(number(a), number(b));
    const std::size_t second = std::max(number(a), number(b));
    const auto [entry, is_new] =
        edges_.try_emplace(first * values_.size() + second, static_cast<int>(vertices_.size()));
    if (is_new) {
      const double share = std::clamp(value(a) / (value(a) - value(b)), 0.2, 0.8);
      vertices_.push_back((place(a) + share * (place(b) - place(a))).cast<float>());
    }
    return entry->second;
  }

  // Whether b, c, d turn counter-clockwise for an eye on the other side of them than a.
  static bool isPositive(const Node& a, const Node& b, const Node& c, const Node& d) {
    return (b - a).dot((c - a).cross(d - a)) > 0;
  }

  // Faces between the inner and the outer corners of a tetrahedron, turned outwards.
  void cut(const std::array<Node, 4>& corners) {
    std::vector<Node> inner, outer;
    for (const Node& corner : corners) (value(corner) < 0.0 ? inner : outer).push_back(corner);
    if (inner.size() == 1) {
      if (!isPositive(inner[0], outer[0], outer[1], outer[2])) std::swap(outer[1], outer[2]);
      addFace(vertexBetween(inner[0], outer[0]), vertexBetween(inner[0], outer[1]),
              vertexBetween(inner[0], outer[2]));
    } else if (inner.size() == 3) {
      if (isPositive(outer[0], inner[0], inner[1], inner[2])) std::swap(inner[1], inner[2]);
      addFace(vertexBetween(inner[0], outer[0]), vertexBetween(inner[1], outer[0]),
              vertexBetween(inner[2], outer[0]));
    } else if (inner.size() == 2) {
      if (!isPositive(inner[0], outer[0], outer[1], inner[1])) std::swap(outer[0], outer[1]);
      const int first = vertexBetween(inner[0], outer[0]);
      const int third = vertexBetween(inner[1], outer[1]);
      addFace(first, vertexBetween(inner[0], outer[1]), third);
      addFace(first, third, vertexBetween(inner[1], outer[0]));
    }
  }

  void addFace(int a, int b, int c) { faces_.emplace_back(a, b, c); }

  Eigen::Vector3d origin_;
  double spacing_;
  Node nodes_;
  std::vector<double> values_;
  std::unordered_map<std::size_t, int> edges_;
  std::vector<Eigen::Vector3f> vertices_;
  std::vector<Eigen::Vector3i> faces_;
};

/// Value and gradient, by differences.
struct Slope {
  double value;
  Eigen::Vector3d gradient;

  Slope(const Solid& solid, const Eigen::Vector3d& point, double step) : value(solid(point)) {
    for (int axis = 0; axis < 3; ++axis) {
      gradient[axis] = (solid(point + step * Eigen::Vector3d::Unit(axis)) - value) / step;
    }
  }
};

/// Each vertex halfway to the mean of its neighbours.
Points relaxed(const Surface& surface) {
  const Points& points = surface.vertices.points;
  Points sums = Points::Zero(3, points.cols());
  Eigen::RowVectorXf counts = Eigen::RowVectorXf::Zero(points.cols());
  for (Eigen::Index face = 0; face < surface.faces.cols(); ++face) {
    for (int k = 0; k < 3; ++k) {
      const int to = surface.faces((k + 1) % 3, face);
      sums.col(to) += points.col(surface.faces(k, face));
      counts[to] += 1.0F;
    }
  }
  return 0.5F * (points.array() + sums.array().rowwise() / counts.array());
}

}  // namespace

Surface cutOut(const Solid& solid, const Eigen::AlignedBox3d& box, double spacing) {
  return MarchingTetrahedra(solid, box, spacing).run();
}

void evenOut(const Solid& solid, Surface& surface) {
  Points& points = surface.vertices.points;
  const double step = 1e-5 * extent(points);
  for (int round = 0; round < kSmoothingSteps; ++round) {
    points = relaxed(surface);
    for (Eigen::Index i = 0; i < points.cols(); ++i) {  // Newton's step back onto the surface
      const Eigen::Vector3d point = points.col(i).cast<double>();
      const Slope slope(solid, point, step);
      const double steepness = std::max(slope.gradient.squaredNorm(), 0.1);
      points.col(i) = (point - slope.value / steepness * slope.gradient).cast<float>();
    }
  }
  surface.vertices.normals.resize(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Slope slope(solid, points.col(i).cast<double>(), step);
    surface.vertices.normals.col(i) = slope.gradient.normalized().cast<float>();
  }
}

}  // namespace unirit
