// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// Distance of each cloud point to the moved surface. A residual, not an accuracy: it says nothing
/// about motion along the surface, nor about what was not seen.
struct SurfaceResidual {
  double rms = 0.0;              ///< [m]
  double median = 0.0;           ///< [m]
  double p95 = 0.0;              ///< 95th percentile [m]
  double inlier_fraction = 0.0;  ///< share of cloud points within the inlier tolerance
  double coverage = 0.0;         ///< share of the organ's points with a cloud point nearby
};

/// The non-rigid displacement over the organ.
struct DisplacementStatistics {
  double rms = 0.0;              ///< [m]
  double p95 = 0.0;              ///< [m]
  double max = 0.0;              ///< [m]
  double folded_fraction = 0.0;  ///< share of points where the Jacobian determinant is <= 0
  double stretch = 1.0;          ///< largest principal stretch of a point, 95th percentile
  double compression = 1.0;      ///< smallest principal stretch of a point, 5th percentile
};

/// The value below which `share` of the values lie: the one of nearest rank, share in [0, 1].
/// Throws std::invalid_argument where there is none.
double quantile(std::vector<float> values, double share);

/// Root mean square distance between points of the same column [m]. Throws std::invalid_argument
/// where the sizes differ or are zero.
double rootMeanSquareDistance(const Points& a, const Points& b);

/// Distance from each point of `from` to its nearest point of `to` [m], a row of from.cols().
Eigen::RowVectorXf nearestDistances(const Points& from, const Points& to);

/// Of large clouds a share is looked at, drawn by lot: distances are those of about 10,000 points
/// of the cloud to about 60,000 of the surface, coverage that of about 10,000 points of the surface
/// by about 20,000 of the cloud.
SurfaceResidual surfaceResidual(const Points& moved_surface, const Points& cloud,
                                double inlier_tolerance);

/// `displacements`: of the organ's points, 3 x N; `jacobians`: Deformation::jacobians, of as many
/// points as one likes. Throws std::invalid_argument where there is none of either.
DisplacementStatistics displacementStatistics(const Points& displacements,
                                              const std::vector<Eigen::Matrix3f>& jacobians);

}  // namespace unirit
