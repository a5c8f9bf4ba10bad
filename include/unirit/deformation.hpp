// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// Takes points of the pre-operative frame to the intra-operative one: the rigid transform, then a
/// displacement known at the organ's surface points. Immutable, so safe to read from any thread.
class Deformation {
 public:
  /// `surface`: 3 x N pre-operative points [m]; `displacements`: 3 x N, added after the rigid
  /// transform, in the intra-operative frame [m]. Throws std::invalid_argument where sizes differ.
  Deformation(const Eigen::Isometry3d& T_intraoperative_preoperative, Points surface,
              Points displacements);
  ~Deformation();

  /// The surface points, moved by the whole registration; same order.
  Points movedSurface() const;

  /// Any points of the pre-operative frame, moved. A surface point gets its own displacement, any
  /// other the inverse-distance mean of its 8 nearest surface points'.
  Points move(const Points& preoperative) const;

  /// Any points of the pre-operative frame, moved by the rigid part alone.
  Points moveRigidly(const Points& preoperative) const;

  const Eigen::Isometry3d& rigidTransform() const { return T_intraoperative_preoperative_; }
  const Points& displacements() const { return displacements_; }

 private:
  struct Index;  // k-d tree over the surface points
  Eigen::Isometry3d T_intraoperative_preoperative_;
  Points surface_;
  Points displacements_;
  std::unique_ptr<const Index> index_;
};

}  // namespace unirit
