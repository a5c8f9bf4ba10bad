// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// A cloud's points by the cubes they lie in; what it says does not depend on their order. PCL's
/// VoxelGrid takes means, which do; PCL's UniformSampling takes several times as long.
class VoxelGrid {
 public:
  /// Whether single precision tells cubes of this edge [m] apart as far out as the cloud reaches.
  static bool resolves(const Points& points, double edge);

  /// Where it does; the corners of the cubes are multiples of their edge.
  VoxelGrid(const Points& points, double edge);

  Eigen::Index voxels() const { return static_cast<Eigen::Index>(voxels_.size()); }
  Eigen::Index points() const;  ///< in all of them

  /// Drops the voxels that, with the 26 around them, hold fewer points than this share of the
  /// median over all voxels. PCL's StatisticalOutlierRemoval takes a second for 500,000 points, and
  /// leaves most flying pixels in a cloud that was thinned before.
  void dropSparse(double min_density);

  /// The point of each voxel that is nearest to its centre, in the order of the voxels: columns of
  /// the cloud.
  std::vector<Eigen::Index> representatives() const;

 private:
  struct Voxel {
    std::int64_t key;     ///< z, y, x: 21 bits each
    Eigen::Index column;  ///< of the point nearest to the centre
    float distance;       ///< of that one, squared, over the edge
    std::int32_t points = 0;
  };

  std::vector<std::int64_t> pointsAround() const;

  std::vector<Voxel> voxels_;  ///< by key
};

}  // namespace unirit
