// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/sampling.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "unirit/random.hpp"

namespace unirit {
namespace {

constexpr Eigen::Index kDense = 8;  // times the points asked for: thinned first, to save time
constexpr int kVoxelsAcross = 64;   // of the longest side: about 8,000 voxels on an organ's surface

/// One point a voxel, the one nearest to its centre: a choice that no order of the points changes.
std::vector<Eigen::Index> thin(const Points& points) {
  const Eigen::Vector3f lowest = points.rowwise().minCoeff();
  const float longest = (points.rowwise().maxCoeff() - lowest).maxCoeff();
  const float edge = std::max(longest / kVoxelsAcross, 1e-12F);
  struct Voxel {
    float distance = std::numeric_limits<float>::infinity();  // squared, of the point to the centre
    int point = 0;
  };
  constexpr std::size_t kAcross = kVoxelsAcross + 1;  // the farthest point begins another one
  std::vector<Voxel> voxels(kAcross * kAcross * kAcross);
  for (int i = 0; i < points.cols(); ++i) {
    const Eigen::Array3f place = (points.col(i) - lowest).array() / edge;
    const Eigen::Array3i corner = place.cast<int>().max(0).min(kVoxelsAcross);
    const float distance = (place - corner.cast<float>() - 0.5F).square().sum();
    const auto cell = corner.cast<std::size_t>().eval();
    Voxel& voxel = voxels[(cell[2] * kAcross + cell[1]) * kAcross + cell[0]];
    if (distance < voxel.distance ||
        (distance == voxel.distance && lessByCoordinates(points.col(i), points.col(voxel.point)))) {
      voxel = {distance, i};
    }
  }
  std::vector<Eigen::Index> kept;
  for (const Voxel& voxel : voxels) {
    if (std::isfinite(voxel.distance)) kept.push_back(voxel.point);
  }
  return kept;
}

/// Farthest point sampling (Eldar et al. 1997), started at the point farthest from the centroid.
/// The points are sorted by x: a chosen one is the nearest to few blocks of them.
class FarthestPoints {
 public:
  explicit FarthestPoints(const Points& sorted)
      : coordinates_(sorted.transpose()),
        distances_(sorted.cols()),
        largest_(static_cast<std::size_t>((sorted.cols() + kBlock - 1) / kBlock)) {
    forget();
    approach(centroid(sorted));
    farthest_ = findFarthest();
    forget();
  }

  /// The point farthest from those taken so far.
  Eigen::Index take() {
    const Eigen::Index taken = farthest_;
    approach(coordinates_.row(taken).transpose());
    farthest_ = findFarthest();
    return taken;
  }

 private:
  static constexpr Eigen::Index kBlock = 64;

  void forget() {
    distances_.setConstant(std::numeric_limits<float>::max());
    std::fill(largest_.begin(), largest_.end(), std::numeric_limits<float>::max());
  }

  void approach(const Eigen::Vector3f& point) {
    for (std::size_t block = 0; block < largest_.size(); ++block) {
      const Eigen::Index begin = static_cast<Eigen::Index>(block) * kBlock;
      const Eigen::Index count = std::min(kBlock, distances_.size() - begin);
      const auto along = [&](int axis) { return coordinates_.col(axis).segment(begin, count); };
      const float gap = std::max({along(0)[0] - point[0], point[0] - along(0)[count - 1], 0.0F});
      if (gap * gap >= largest_[block]) continue;
      auto distances = distances_.segment(begin, count);
      distances = distances.min((along(0) - point[0]).square() + (along(1) - point[1]).square() +
                                (along(2) - point[2]).square());
      largest_[block] = distances.maxCoeff();
    }
  }

  Eigen::Index findFarthest() const {
    const auto block = std::max_element(largest_.begin(), largest_.end()) - largest_.begin();
    const Eigen::Index begin = block * kBlock;
    Eigen::Index within = 0;
    distances_.segment(begin, std::min(kBlock, distances_.size() - begin)).maxCoeff(&within);
    return begin + within;
  }

  Eigen::ArrayX3f coordinates_;  // one axis a column, for the vector unit
  Eigen::ArrayXf distances_;     // squared, to the nearest point taken
  std::vector<float> largest_;   // of each block
  Eigen::Index farthest_ = 0;
};

/// Uniform in 64 bits, the same for the same point.
std::uint64_t lot(const Eigen::Vector3f& point) {
  std::array<std::uint32_t, 3> bits;
  std::memcpy(bits.data(), point.data(), sizeof(bits));
  const std::uint64_t first = Random((std::uint64_t{bits[0]} << 32U) | bits[1]).next();
  return Random(first ^ bits[2]).next();
}

}  // namespace

Points select(const Points& points, const std::vector<Eigen::Index>& indices) {
  Points selected(3, static_cast<Eigen::Index>(indices.size()));
  for (std::size_t i = 0; i < indices.size(); ++i) {
    selected.col(static_cast<Eigen::Index>(i)) = points.col(indices[i]);
  }
  return selected;
}

bool lessByCoordinates(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

std::vector<Eigen::Index> sampleEvenly(const Points& points, Eigen::Index count) {
  if (count < 1) throw std::invalid_argument("count: at least one point must be asked for");
  std::vector<Eigen::Index> candidates(static_cast<std::size_t>(points.cols()));
  std::iota(candidates.begin(), candidates.end(), 0);
  if (points.cols() > kDense * count) {
    std::vector<Eigen::Index> thinned = thin(points);
    if (static_cast<Eigen::Index>(thinned.size()) >= count) candidates = std::move(thinned);
  }
  // From here on the sequence is that of the coordinates, whatever the cloud's was.
  std::sort(candidates.begin(), candidates.end(), [&](Eigen::Index a, Eigen::Index b) {
    return lessByCoordinates(points.col(a), points.col(b));
  });
  if (static_cast<Eigen::Index>(candidates.size()) <= count) return candidates;
  FarthestPoints farthest(select(points, candidates));
  std::vector<Eigen::Index> chosen(static_cast<std::size_t>(count));
  for (Eigen::Index& index : chosen) index = candidates[static_cast<std::size_t>(farthest.take())];
  return chosen;
}

std::vector<Eigen::Index> drawByLot(const Points& points, Eigen::Index count) {
  if (count < 1) throw std::invalid_argument("count: at least one point must be asked for");
  std::vector<Eigen::Index> drawn;
  const bool all = points.cols() <= count;
  drawn.reserve(static_cast<std::size_t>(std::min(points.cols(), 2 * count)));
  const auto limit =
      all ? 0
          : static_cast<std::uint64_t>(
                std::ldexp(static_cast<double>(count) / static_cast<double>(points.cols()), 64));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (all || lot(points.col(i)) < limit) drawn.push_back(i);
  }
  return drawn;
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
