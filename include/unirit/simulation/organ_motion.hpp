// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "unirit/point_cloud.hpp"
#include "unirit/simulation/thin_plate_spline.hpp"

namespace unirit {

/// How an organ moves during surgery. Lengths relative to the organ's extent fit any organ.
struct MotionSettings {
  double breathing_period = 4.0;      ///< [s]
  double breathing_amplitude = 0.04;  ///< shift towards the feet (-z) at full breath, over extent
  double bulge_amplitude = 0.04;      ///< height of a pneumoperitoneum-like bulge, over the extent
  double deformation = 0.03;          ///< RMS of a smooth random deformation, over the extent
  double rigid_rotation = 10.0;       ///< largest slow rotation [degree]
  double rigid_translation = 0.05;    ///< largest slow shift, over the extent
};

/// The true motion of a simulated organ: every point's position at every time is known. Breathing
/// shifts the organ and swells the random deformation from half to whole; the bulge, the rotation
/// about the organ's centre and the shift come and go slowly. Immutable.
class OrganMotion {
 public:
  /// `organ`: its surface points [m]. Throws std::invalid_argument where there are fewer than 4,
  /// a setting is negative or not finite, or the deformation is so large that space folds.
  OrganMotion(const Points& organ, const MotionSettings& settings, std::uint64_t seed);

  /// Points of the pre-operative frame at time t [s], in the patient's fixed frame [m].
  Points at(const Points& preoperative, double t) const;

 private:
  MotionSettings settings_;
  double extent_ = 0.0;
  Eigen::Vector3f centre_;
  ThinPlateSpline spline_;
  Eigen::Vector3f rotation_axis_, shift_direction_, bulge_top_;
};

}  // namespace unirit
