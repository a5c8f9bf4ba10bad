// SPDX-License-Identifier: BSD-3-Clause
#include "preprocessing/voxel_grid.hpp"

#include <algorithm>
#include <unordered_map>

namespace unirit {
namespace {

constexpr std::int64_t kReach = 1 << 20;  // voxels from the origin
constexpr std::int64_t kStepY = std::int64_t{1} << 21;
constexpr std::int64_t kStepZ = std::int64_t{1} << 42;

bool isLess(const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace

bool VoxelGrid::resolves(const Points& points, double edge) {
  return points.cwiseAbs().maxCoeff() < edge * static_cast<double>(kReach - 2);
}

VoxelGrid::VoxelGrid(const Points& points, double edge) {
  const auto scale = static_cast<float>(1.0 / edge);
  std::unordered_map<std::int64_t, Voxel> voxels;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Array3f place = points.col(i).array() * scale;
    const Eigen::Array3f corner = place.floor();
    const auto cell = (corner.cast<std::int64_t>() + kReach).eval();
    const std::int64_t key = cell[2] * kStepZ + cell[1] * kStepY + cell[0];
    const float distance = (place - corner - 0.5F).square().sum();
    Voxel& voxel = voxels.try_emplace(key, Voxel{key, i, distance}).first->second;
    ++voxel.points;
    if (distance < voxel.distance ||
        (distance == voxel.distance && isLess(points.col(i), points.col(voxel.column)))) {
      voxel.column = i;
      voxel.distance = distance;
    }
  }
  voxels_.reserve(voxels.size());
  for (const auto& entry : voxels) voxels_.push_back(entry.second);
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
