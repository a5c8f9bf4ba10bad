// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/normals.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <queue>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "neighbours.hpp"

namespace unirit {
namespace {

constexpr std::size_t kNormalNeighbours = 14;  // the point itself among them

/// For every point the points whose neighbour it is, and its own neighbours.
std::vector<std::vector<Eigen::Index>> neighbourGraph(const Points& points) {
  const Neighbours neighbours(points);
  std::vector<std::vector<Eigen::Index>> graph(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto nearest = neighbours.find<kNormalNeighbours>(points.col(i));
    for (std::size_t k = 0; k < nearest.count; ++k) {
      const auto j = static_cast<Eigen::Index>(nearest.indices[k]);
      if (j == i) continue;
      graph[static_cast<std::size_t>(i)].push_back(j);
      graph[static_cast<std::size_t>(j)].push_back(i);
    }
  }
  return graph;
}

/// Carries the sign of the root's normal to all points that can be reached from it; which these
/// are.
std::vector<Eigen::Index> propagate(Eigen::Index root,
                                    const std::vector<std::vector<Eigen::Index>>& graph,
                                    Points& normals, std::vector<bool>& oriented) {
  std::vector<Eigen::Index> piece;
  using Edge = std::tuple<float, Eigen::Index, Eigen::Index>;  // agreement, from, to
  std::priority_queue<Edge> edges;
  const auto reach = [&](Eigen::Index i) {
    oriented[static_cast<std::size_t>(i)] = true;
    piece.push_back(i);
    for (const Eigen::Index j : graph[static_cast<std::size_t>(i)]) {
      if (!oriented[static_cast<std::size_t>(j)])
        edges.emplace(std::abs(normals.col(i).dot(normals.col(j))), i, j);
    }
  };
  reach(root);
  while (!edges.empty()) {
    const auto [agreement, from, to] = edges.top();
    edges.pop();
    if (oriented[static_cast<std::size_t>(to)]) continue;
    if (normals.col(from).dot(normals.col(to)) < 0.0F) normals.col(to) *= -1.0F;
    reach(to);
  }
  return piece;
}

}  // namespace

Points estimateNormals(const Points& points) {
  if (points.cols() < 3) throw std::invalid_argument("points: three at least make a surface");
  const Neighbours neighbours(points);
  Points normals(3, points.cols());
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto nearest = neighbours.find<kNormalNeighbours>(points.col(i));
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
    for (std::size_t k = 0; k < nearest.count; ++k) {
      const Eigen::Vector3f offset =
          points.col(static_cast<Eigen::Index>(nearest.indices[k])) - points.col(i);
      sum += offset;
      scatter += offset * offset.transpose();
    }
    scatter -= sum * sum.transpose() / static_cast<float>(nearest.count);
    solver.computeDirect(scatter);
    normals.col(i) = solver.eigenvectors().col(0);
  }
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
    for (const int corner : face) normals.col(corner) += twice_area;
  }
  for (auto normal : normals.colwise()) normal.stableNormalize();
  return normals;
}

void orientOutwards(const Points& points, Points& normals) {
  const auto graph = neighbourGraph(points);
  const Points offsets = points.colwise() - centroid(points);
  std::vector<bool> oriented(static_cast<std::size_t>(points.cols()), false);
  for (Eigen::Index root = 0; root < points.cols(); ++root) {
    if (oriented[static_cast<std::size_t>(root)]) continue;
    const std::vector<Eigen::Index> piece = propagate(root, graph, normals, oriented);
    double outwards = 0.0;
    for (const Eigen::Index i : piece) outwards += normals.col(i).dot(offsets.col(i));
    if (outwards >= 0.0) continue;
    for (const Eigen::Index i : piece) normals.col(i) *= -1.0F;
  }
}

void orientTowards(const Points& points, const Eigen::Vector3f& viewpoint, Points& normals) {
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (normals.col(i).dot(viewpoint - points.col(i)) < 0.0F) normals.col(i) *= -1.0F;
  }
}

double openness(const Points& normals) { return normals.cast<double>().rowwise().mean().norm(); }

}  // namespace unirit
