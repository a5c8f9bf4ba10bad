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
  double breathing_amplitude = 0.04;  ///< translation, over the extent
  double bulge_amplitude = 0.04;      ///< pneumoperitoneum-like smooth bulge, over the extent
  double deformation = 0.03;          ///< RMS of a smooth random deformation, over the extent
  double rigid_rotation = 10.0;       ///< largest slow rotation [degree]
  double rigid_translation = 0.05;    ///< largest slow shift, over the extent
};

/// The true motion of a simulated organ: every point's position at every time is known.
class OrganMotion {
 public:
  OrganMotion(const Points& organ, const MotionSettings& settings, std::uint64_t seed);

  /// Points of the pre-operative frame at time t [s], in the patient's fixed frame [m].
  Points at(const Points& preoperative, double t) const;

 private:
  MotionSettings settings_;
  double extent_ = 0.0;
  Eigen::Vector3f centre_;
  ThinPlateSpline spline_;
  Eigen::Vector3f axis_, shift_direction_, bulge_centre_;
};

}  // namespace unirit
