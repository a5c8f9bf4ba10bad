// SPDX-License-Identifier: BSD-3-Clause
#include "preprocessing/voxel_grid.hpp"

#include <algorithm>
#include <utility>

#include "unirit/sampling.hpp"

namespace unirit {
namespace {

constexpr std::int64_t kReach = 1 << 20;  // voxels from the origin
constexpr std::int64_t kStepY = std::int64_t{1} << 21;
constexpr std::int64_t kStepZ = std::int64_t{1} << 42;

/// Where in a list the voxel of a key stands. Open addressing: a standard map, which allocates each
/// entry by itself, takes more than twice the time.
class Places {
 public:
  /// `voxels`: all that were added so far, with their keys; where the key is new, its place is the
  /// end of the list, and the caller appends it.
  template <class Voxels>
  std::size_t find(std::int64_t key, const Voxels& voxels) {
    if (2 * voxels.size() >= places_.size()) grow(voxels);
    const std::size_t slot = slotOf(key, voxels);
    if (places_[slot] == kNone) places_[slot] = static_cast<std::uint32_t>(voxels.size());
    return places_[slot];
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;

  template <class Voxels>
  std::size_t slotOf(std::int64_t key, const Voxels& voxels) const {
    constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15;  // Fibonacci hashing (Knuth 1973)
    std::size_t slot = (static_cast<std::uint64_t>(key) * kGoldenRatio) >> 32U;
    while (true) {
      slot &= places_.size() - 1;  // a power of two
      if (places_[slot] == kNone || voxels[places_[slot]].key == key) return slot;
      ++slot;
    }
  }

  template <class Voxels>
  void grow(const Voxels& voxels) {
    places_.assign(std::max<std::size_t>(4 * places_.size(), 1U << 14U), kNone);
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      places_[slotOf(voxels[i].key, voxels)] = static_cast<std::uint32_t>(i);
    }
  }

  std::vector<std::uint32_t> places_;
};

}  // namespace

bool VoxelGrid::resolves(const Points& points, double edge) {
  return points.cwiseAbs().maxCoeff() < edge * static_cast<double>(kReach - 2);
}

VoxelGrid::VoxelGrid(const Points& points, double edge) {
  const auto scale = static_cast<float>(1.0 / edge);
  Places places;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Array3f place = points.col(i).array() * scale;
    const Eigen::Array3f corner = place.floor();
    const auto cell = (corner.cast<std::int64_t>() + kReach).eval();
    const std::int64_t key = cell[2] * kStepZ + cell[1] * kStepY + cell[0];
    const float distance = (place - corner - 0.5F).square().sum();
    const std::size_t found = places.find(key, voxels_);
    if (found == voxels_.size()) voxels_.push_back({key, i, distance});
    Voxel& voxel = voxels_[found];
    ++voxel.points;
    if (distance < voxel.distance || (distance == voxel.distance &&
                                      lessByCoordinates(points.col(i), points.col(voxel.column)))) {
      voxel.column = i;
      voxel.distance = distance;
    }
  }
  std::sort(voxels_.begin(), voxels_.end(),
            [](const Voxel& a, const Voxel& b) { return a.key < b.key; });
}

Eigen::Index VoxelGrid::points() const {
  Eigen::Index sum = 0;
  for (const Voxel& voxel : voxels_) sum += voxel.points;
  return sum;
}

/// Of each voxel and the 26 around it. Along each of the 9 rows of voxels around it, those wanted
/// move on with the voxel, so a cursor a row finds them without a search.
std::vector<std::int64_t> VoxelGrid::pointsAround() const {
  std::vector<std::int64_t> around(voxels_.size(), 0);
  for (const std::int64_t z : {-kStepZ, std::int64_t{0}, kStepZ}) {
    for (const std::int64_t y : {-kStepY, std::int64_t{0}, kStepY}) {
      std::size_t first = 0;
      for (std::size_t i = 0; i < voxels_.size(); ++i) {
        const std::int64_t middle = voxels_[i].key + z + y;
        while (first < voxels_.size() && voxels_[first].key < middle - 1) ++first;
        for (std::size_t k = first; k < voxels_.size() && voxels_[k].key <= middle + 1; ++k) {
          around[i] += voxels_[k].points;
        }
      }
    }
  }
  return around;
}

void VoxelGrid::dropSparse(double min_density) {
  const std::vector<std::int64_t> around = pointsAround();
  std::vector<std::int64_t> ranked = around;
  const auto middle = ranked.begin() + static_cast<std::ptrdiff_t>(ranked.size() / 2);
  std::nth_element(ranked.begin(), middle, ranked.end());
  const double least = min_density * static_cast<double>(*middle);
  std::vector<Voxel> kept;
  for (std::size_t i = 0; i < voxels_.size(); ++i) {
    if (static_cast<double>(around[i]) >= least) kept.push_back(voxels_[i]);
  }
  voxels_ = std::move(kept);
}

std::vector<Eigen::Index> VoxelGrid::representatives() const {
  std::vector<Eigen::Index> columns;
  for (const Voxel& voxel : voxels_) columns.push_back(voxel.column);
  return columns;
}

}  // namespace unirit
