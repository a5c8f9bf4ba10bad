// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/sampling.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "unirit/random.hpp"

namespace unirit {
namespace {

constexpr int kVoxelsAcross = 64;  // of the longest side: about 8,000 voxels on an organ's surface

struct Thinned {
  std::uint64_t voxel = 0;
  float distance = 0.0F;  // squared, to the voxel's centre
  Eigen::Index index = 0;
};

bool lessByCoordinates(const Points& points, Eigen::Index a, Eigen::Index b) {
  return std::make_tuple(points(0, a), points(1, a), points(2, a)) <
         std::make_tuple(points(0, b), points(1, b), points(2, b));
}

/// One point a voxel, the one nearest to its centre: a choice that no order of the points changes.
std::vector<Eigen::Index> thin(const Points& points) {
  const Eigen::Vector3f lowest = points.rowwise().minCoeff();
  const float longest = (points.rowwise().maxCoeff() - lowest).maxCoeff();
  const float edge = std::max(longest / kVoxelsAcross, 1e-12F);
  std::vector<Thinned> candidates(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Array3f place = (points.col(i) - lowest).array() / edge;
    const Eigen::Array3f corner = place.floor();
    const auto cell = corner.cast<std::uint64_t>().eval();
    candidates[static_cast<std::size_t>(i)] = {(cell[2] << 42U) | (cell[1] << 21U) | cell[0],
                                               (place - corner - 0.5F).square().sum(), i};
  }
  std::sort(candidates.begin(), candidates.end(), [&](const Thinned& a, const Thinned& b) {
    if (a.voxel != b.voxel) return a.voxel < b.voxel;
    if (a.distance != b.distance) return a.distance < b.distance;
    return lessByCoordinates(points, a.index, b.index);
  });
  std::vector<Eigen::Index> kept;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (k == 0 || candidates[k].voxel != candidates[k - 1].voxel)
      kept.push_back(candidates[k].index);
  }
  return kept;
}

/// Farthest point sampling (Eldar et al. 1997), started at the point farthest from the centroid.
std::vector<Eigen::Index> farthestPoints(const Points& points, Eigen::Index count) {
  const Eigen::ArrayX3f coordinates = points.transpose();  // one axis a column, for the vector unit
  const auto squaredDistances = [&](const Eigen::Vector3f& p) -> Eigen::ArrayXf {
    return (coordinates.col(0) - p[0]).square() + (coordinates.col(1) - p[1]).square() +
           (coordinates.col(2) - p[2]).square();
  };
  Eigen::ArrayXf distances = squaredDistances(centroid(points));
  std::vector<Eigen::Index> chosen;
  Eigen::Index next = 0;
  distances.maxCoeff(&next);
  distances.setConstant(std::numeric_limits<float>::max());
  while (static_cast<Eigen::Index>(chosen.size()) < count) {
    chosen.push_back(next);
    distances = distances.min(squaredDistances(points.col(next)));
    distances.maxCoeff(&next);
  }
  return chosen;
}

}  // namespace

Points select(const Points& points, const std::vector<Eigen::Index>& indices) {
  Points selected(3, static_cast<Eigen::Index>(indices.size()));
  for (std::size_t i = 0; i < indices.size(); ++i) {
    selected.col(static_cast<Eigen::Index>(i)) = points.col(indices[i]);
  }
  return selected;
}

std::vector<Eigen::Index> sampleEvenly(const Points& points, Eigen::Index count) {
  if (count < 1) throw std::invalid_argument("count: at least one point must be asked for");
  std::vector<Eigen::Index> candidates(static_cast<std::size_t>(points.cols()));
  std::iota(candidates.begin(), candidates.end(), 0);
  if (points.cols() > count) {
    std::vector<Eigen::Index> thinned = thin(points);
    if (static_cast<Eigen::Index>(thinned.size()) >= count) candidates = std::move(thinned);
  }
  // From here on the sequence is that of the coordinates, whatever the cloud's was.
  std::sort(candidates.begin(), candidates.end(),
            [&](Eigen::Index a, Eigen::Index b) { return lessByCoordinates(points, a, b); });
  if (static_cast<Eigen::Index>(candidates.size()) <= count) return candidates;
  std::vector<Eigen::Index> chosen = farthestPoints(select(points, candidates), count);
  for (Eigen::Index& index : chosen) index = candidates[static_cast<std::size_t>(index)];
  return chosen;
}

PointCloud sampleByArea(const Surface& mesh, Eigen::Index count, std::uint64_t seed) {
  const Points& vertices = mesh.vertices.points;
  std::vector<double> cumulative;
  double total = 0.0;
  Points normals(3, mesh.faces.cols());
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    const Eigen::Vector3i face = mesh.faces.col(f);
    const Eigen::Vector3f a = vertices.col(face[0]);
    const Eigen::Vector3f normal = (vertices.col(face[1]) - a).cross(vertices.col(face[2]) - a);
    normals.col(f) = normal.normalized();
    total += static_cast<double>(normal.norm()) / 2.0;
    cumulative.push_back(total);
  }
  if (!(total > 0.0)) throw std::invalid_argument("mesh: has no face with an area");

  Random random(seed);
  PointCloud samples{Points(3, count), Points(3, count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto place =
        std::upper_bound(cumulative.begin(), cumulative.end(), random.uniform(0, total));
    const Eigen::Index f =
        std::min<Eigen::Index>(place - cumulative.begin(), mesh.faces.cols() - 1);
    auto u = static_cast<float>(random.uniform()), v = static_cast<float>(random.uniform());
    if (u + v > 1.0F) {
      u = 1.0F - u;
      v = 1.0F - v;
    }
    const Eigen::Vector3i face = mesh.faces.col(f);
    const Eigen::Vector3f a = vertices.col(face[0]);
    samples.points.col(i) = a + u * (vertices.col(face[1]) - a) + v * (vertices.col(face[2]) - a);
    samples.normals.col(i) = normals.col(f);
  }
  return samples;
}

}  // namespace unirit
