// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// A smooth deformation of space: thin-plate spline (Bookstein 1989, kernel |r| in 3-D) through
/// random vectors at 27 to 64 blue-noise control points of the padded bounding box.
class ThinPlateSpline {
 public:
  static constexpr int kMostCentres = 64;

  /// Displacement of each point, 3 x N, same unit as the points it was made for.
  Points displacements(const Points& points) const;

  /// Jacobian determinant of p + displacement(p) at each point; at or below zero space folds.
  Eigen::RowVectorXf jacobianDeterminants(const Points& points) const;

 private:
  friend ThinPlateSpline randomDeformation(const Points&, double, std::uint64_t);
  double jacobianDeterminant(const Eigen::Vector3d& p) const;
  bool folds(const Points& points) const;

  /// K x 3 with room for the most there can be: one axis a column, for the vector unit.
  using Centres = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMostCentres, 3>;
  Centres centres_;
  Centres weights_;
  Eigen::Matrix<double, 3, 4> affine_;  // [linear | constant]
};

/// A random deformation whose displacement over `points` has the given RMS. Draws in which more
/// than 0.2 % of the points have a Jacobian determinant below 0.1 are drawn again. Deterministic
/// for a seed. Throws std::invalid_argument on fewer than 4 points, or an RMS that is negative or so
/// large that no draw is free of folds.
ThinPlateSpline randomDeformation(const Points& points, double rms, std::uint64_t seed);

}  // namespace unirit
