// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/normals.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numeric>
#include <queue>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "neighbours.hpp"

namespace unirit {
namespace {

/// Points joined to their nearest ones and to those whose nearest they are.
class NeighbourGraph {
 public:
  explicit NeighbourGraph(const Eigen::MatrixXi& nearest)
      : begins_(at(nearest.cols()) + 1, nearest.rows()), joined_(at(2 * nearest.size())) {
    begins_.back() = 0;
    for (Eigen::Index k = 0; k < nearest.size(); ++k) ++begins_[at(nearest.data()[k])];
    // Ends at first; filling from the back turns them into beginnings
    std::partial_sum(begins_.begin(), begins_.end(), begins_.begin());
    for (Eigen::Index i = 0; i < nearest.cols(); ++i) {
      for (Eigen::Index k = 0; k < nearest.rows(); ++k) {
        const int j = nearest(k, i);
        joined_[at(--begins_[at(i)])] = j;
        joined_[at(--begins_[at(j)])] = static_cast<int>(i);
      }
    }
  }

  /// Calls visit(j) for all points joined to i, for some of them twice.
  template <class Visit>
  void forEach(Eigen::Index i, const Visit& visit) const {
    for (Eigen::Index k = begins_[at(i)]; k < begins_[at(i) + 1]; ++k) visit(joined_[at(k)]);
  }

 private:
  static std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

  std::vector<Eigen::Index> begins_;
  std::vector<int> joined_;
};

/// Carries the sign of a root's normal to all points that can be reached from it, along the edges
/// that agree best (Prim 1957).
class Orientation {
 public:
  Orientation(const NeighbourGraph& graph, Points& normals)
      : graph_(graph), normals_(normals), best_(static_cast<std::size_t>(normals.cols())) {
    piece_.reserve(best_.size());
  }

  bool oriented(Eigen::Index i) const { return best_[static_cast<std::size_t>(i)].done; }

  /// The points oriented now, the root among them.
  const std::vector<int>& propagate(int root) {
    piece_.clear();
    reach(root);
    while (!edges_.empty()) {
      const auto [agreement, from, to] = edges_.top();
      edges_.pop();
      if (oriented(to)) continue;
      if (normals_.col(from).dot(normals_.col(to)) < 0.0F) normals_.col(to) *= -1.0F;
      reach(to);
    }
    return piece_;
  }

 private:
  using Edge = std::tuple<float, int, int>;  // agreement, from, to
  struct Best {
    std::pair<float, int> edge{-1.0F, 0};  // agreement, from
    bool done = false;
  };

  void reach(int i) {
    best_[static_cast<std::size_t>(i)].done = true;
    piece_.push_back(i);
    graph_.forEach(i, [&](int j) {
      Best& best = best_[static_cast<std::size_t>(j)];
      if (best.done) return;
      const std::pair edge(std::abs(normals_.col(i).dot(normals_.col(j))), i);
      if (edge <= best.edge) return;
      best.edge = edge;
      edges_.emplace(edge.first, i, j);
    });
  }

  const NeighbourGraph& graph_;
  Points& normals_;
  std::vector<Best> best_;  // way to each point that has been found so far
  std::vector<int> piece_;
  std::priority_queue<Edge> edges_;
};

}  // namespace

Points estimateNormals(const Points& points, const Eigen::MatrixXi& nearest) {
  if (points.cols() < 3) throw std::invalid_argument("points: three at least make a surface");
  Points normals(3, points.cols());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
    for (Eigen::Index k = 0; k < nearest.rows(); ++k) {
      const Eigen::Vector3f offset = points.col(nearest(k, i)) - points.col(i);
      sum += offset;
      scatter += offset * offset.transpose();
    }
    scatter -= sum * sum.transpose() / static_cast<float>(nearest.rows());
    solver.computeDirect(scatter);
    normals.col(i) = solver.eigenvectors().col(0);
  }
  return normals;
}

Points estimateNormals(const Points& points) {
  return estimateNormals(points, nearestPoints(points));
}

void orientOutwards(const Points& points, const Eigen::MatrixXi& nearest, Points& normals) {
  const NeighbourGraph graph(nearest);
  const Eigen::Vector3f centre = centroid(points);
  Orientation orientation(graph, normals);
  for (int root = 0; root < points.cols(); ++root) {
    if (orientation.oriented(root)) continue;
    const std::vector<int>& piece = orientation.propagate(root);
    double outwards = 0.0;
    for (const int i : piece) outwards += normals.col(i).dot(points.col(i) - centre);
    if (outwards >= 0.0) continue;
    for (const int i : piece) normals.col(i) *= -1.0F;
  }
}

void orientOutwards(const Points& points, Points& normals) {
  orientOutwards(points, nearestPoints(points), normals);
}

Points outwardNormals(const Points& points) {
  const Eigen::MatrixXi nearest = nearestPoints(points);
  Points normals = estimateNormals(points, nearest);
  orientOutwards(points, nearest, normals);
  return normals;
}

void turnFacesOutwards(Surface& mesh) {
  if (mesh.faces.cols() == 0) return;
  const Points offsets = mesh.vertices.points.colwise() - centroid(mesh.vertices.points);
  double volume = 0.0;  // six times it
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    const auto corner = [&](int k) { return offsets.col(mesh.faces(k, f)); };
    volume += static_cast<double>(corner(0).dot(corner(1).cross(corner(2))));
  }
  if (volume < 0.0) mesh.faces.row(1).swap(mesh.faces.row(2));
}

Points vertexNormals(const Surface& mesh) {
  const Points& vertices = mesh.vertices.points;
  Points normals = Points::Zero(3, vertices.cols());
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    const Eigen::Vector3i face = mesh.faces.col(f);
    const Eigen::Vector3f a = vertices.col(face[0]);
    const Eigen::Vector3f twice_area = (vertices.col(face[1]) - a).cross(vertices.col(face[2]) - a);
    for (int k = 0; k < 3; ++k) normals.col(face[k]) += twice_area;
  }
  for (Eigen::Index i = 0; i < normals.cols(); ++i) normals.col(i).stableNormalize();
  return normals;
}

void orientTowards(const Points& points, const Eigen::Vector3f& viewpoint, Points& normals) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (normals.col(i).dot(viewpoint - points.col(i)) < 0.0F) normals.col(i) *= -1.0F;
  }
}

double openness(const Points& normals) { return normals.cast<double>().rowwise().mean().norm(); }

}  // namespace unirit
