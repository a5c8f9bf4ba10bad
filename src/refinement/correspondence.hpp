// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "network/aligned_floats.hpp"
#include "network/kernels.hpp"
#include "network/thread_team.hpp"
#include "unirit/point_cloud.hpp"

namespace unirit {

/// How source and target points attract each other. Lengths in the clouds' unit.
struct Attraction {
  float sigma = 0.1F;          ///< standard deviation of the distance
  float outlier_share = 0.1F;  ///< of the target points, a uniform background
  NormalUse normals = NormalUse::kSigned;
  float symmetry = 4.0F;  ///< weight of "each visible source point lies on the target" over
                          ///< "each target point lies on the source"; 0: the latter alone
};

/// What the target says of each source point.
struct Correspondences {
  Eigen::RowVectorXf mass;  ///< N, sum of the responsibilities
  Points positions;         ///< 3 x N, mean target point; the source's own where the mass is zero
  Points normals;           ///< 3 x N, mean target normal, a unit vector or zero
  double fit =
      0.0;  ///< mean log likelihood of target and of visible source points, up to constants
};

/// Soft correspondences of a moving source with a target that stays: the expectation step of
/// coherent point drift (Myronenko & Song 2010, eq. 7), with normals. Target points far from a
/// source point, in units of sigma, are passed over block by block. Allocates only where source,
/// target or what is near grow.
class CorrespondenceEstimator {
 public:
  /// `kernels` and `team` must outlive it.
  CorrespondenceEstimator(const Kernels& kernels, ThreadTeam& team)
      : kernels_(kernels), team_(team) {}

  /// The target from now on, with normals.
  void aimAt(const PointCloud& target);

  /// `source` with normals; `visibility` in [0, 1]: how sure it is that each source point is seen.
  void estimate(const PointCloud& source, const Eigen::RowVectorXf& visibility,
                const Attraction& attraction, Correspondences& correspondences);

 private:
  static constexpr long kBallsAtOnce = 8;
  using Balls = Eigen::Array<float, kBallsAtOnce, 4>;  // centre x, y, z and radius of each

  void reserve(long target_count);
  void boundBlocks();
  long blocksNear(const Eigen::Vector3f& point, float reach, int* nearby) const;
  int* nearbyOf(Eigen::Index source);
  long& countOf(Eigen::Index source);
  float fit(const Eigen::RowVectorXf& visibility, float target_background,
            float source_background) const;
  void findNearby(const PointCloud& source, float reach);
  void findAffinities(const PointCloud& source, const AffinityView& affinity);
  OrientedPointsView view() const;
  float* row(int index);

  const Kernels& kernels_;
  ThreadTeam& team_;
  long target_count_ = 0;
  long padded_ = 0;           // to whole blocks
  AlignedFloats targets_;     // six rows: x, y, z, normal x, y, z
  std::vector<int> order_;    // the target's points, sorted into blocks
  float volume_ = 0.0F;       // of a box with the target's principal variances
  std::vector<Balls> balls_;  // around the blocks
  std::vector<int> nearby_;   // blocks near each source point, one row a point
  std::vector<long> nearby_counts_;
  std::vector<AlignedFloats> affinities_;  // to the blocks near, one array a chunk of source points
  AlignedFloats chunk_sums_;               // of the affinities to each target, one row a chunk
  AlignedFloats target_weights_;
  std::vector<float> source_sums_;
};

}  // namespace unirit
