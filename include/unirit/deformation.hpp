// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// Displacement at any point of the organ, its inside included. Immutable.
class DisplacementField {
 public:
  virtual ~DisplacementField() = default;

  /// Of points of the pre-operative frame, 3 x Q: what is added after the rigid transform, in the
  /// intra-operative frame [m].
  virtual Points displacements(const Points& preoperative) const = 0;

  /// Derivatives of these displacements by the point, one matrix a point.
  virtual std::vector<Eigen::Matrix3f> gradients(const Points& preoperative) const = 0;

  /// How much has been learnt of each point's displacement, a row of Q in [0, 1]: one minus its
  /// variance over the variance before anything was seen. Empty where the field cannot tell.
  virtual Eigen::RowVectorXf confidence(const Points& preoperative) const = 0;

  /// Standard deviation of a point's displacement, as a length, before anything was seen [m]. Zero
  /// where the field cannot tell.
  virtual float priorDeviation() const = 0;
};

/// What a field says of points: its displacements, 3 x Q [m], and its confidence, a row of Q or
/// empty.
struct FieldValues {
  Points displacements;
  Eigen::RowVectorXf confidence;
};

/// Takes points of the pre-operative frame to the intra-operative one: the rigid transform, then a
/// displacement. Immutable, so safe to read from any thread.
class Deformation {
 public:
  /// `surface`: 3 x N pre-operative points [m]; `displacements`: 3 x N, added after the rigid
  /// transform, in the intra-operative frame [m]. Any other point gets the inverse-distance mean of
  /// its 8 nearest surface points' displacements. Throws std::invalid_argument where sizes differ.
  Deformation(const Eigen::Isometry3d& T_intraoperative_preoperative, Points surface,
              Points displacements);

  /// The same with a field of displacements and what it says of the surface points. Throws
  /// std::invalid_argument where there is no field or sizes differ.
  Deformation(const Eigen::Isometry3d& T_intraoperative_preoperative, Points surface,
              std::shared_ptr<const DisplacementField> field, FieldValues at_surface);

  /// The surface points, moved by the whole registration; same order.
  Points movedSurface() const;

  /// Any points of the pre-operative frame, moved.
  Points move(const Points& preoperative) const;

  /// Any points of the pre-operative frame, moved by the rigid part alone.
  Points moveRigidly(const Points& preoperative) const;

  /// Derivatives of `move` by the point, one matrix a point: how the organ turns and is stretched
  /// there. Where its determinant is not positive the organ is folded over.
  std::vector<Eigen::Matrix3f> jacobians(const Points& preoperative) const;

  /// DisplacementField::confidence.
  Eigen::RowVectorXf confidence(const Points& preoperative) const;

  const Eigen::Isometry3d& rigidTransform() const { return T_intraoperative_preoperative_; }

  /// Of the surface points.
  const Points& displacements() const { return at_surface_.displacements; }
  const Eigen::RowVectorXf& confidence() const { return at_surface_.confidence; }

  /// Of the surface points: the standard deviation of each displacement, as a length, that is left
  /// after the cloud was seen [m]. Empty where the field cannot tell.
  Eigen::RowVectorXf deviations() const;

 private:
  Eigen::Isometry3d T_intraoperative_preoperative_;
  Points surface_;
  std::shared_ptr<const DisplacementField> field_;
  FieldValues at_surface_;
};

}  // namespace unirit
