// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "unirit/point_cloud.hpp"
#include "unirit/simulation/depth_camera.hpp"
#include "unirit/simulation/organ_motion.hpp"

namespace unirit {

/// The simulated operating room. Lengths relative to the organ's extent fit any organ.
struct SceneSettings {
  MotionSettings motion;
  DepthCamera camera;
  double camera_distance = 1.6;     ///< from the organ's centre, over its extent
  double guess_rotation = 8.0;      ///< error of the rough pose [degree]
  double guess_translation = 0.04;  ///< error of the rough pose, over the extent
  std::uint64_t seed = 1;
};

/// What the camera sees at a moment, and what is true then.
struct View {
  PointCloud cloud;  ///< in the camera's optical frame [m]
  Points truth;      ///< every organ vertex, same order, in the camera's optical frame [m]
};

/// An organ that lies turned in the world, moves, deforms, and is watched by a depth camera at
/// rest.
class DemoScene {
 public:
  /// `organ`: a mesh in the pre-operative frame [m]; throws std::invalid_argument without faces.
  DemoScene(const Surface& organ, const SceneSettings& settings);

  /// At time t [s] of the organ's motion.
  View viewAt(double t) const;

  /// Where somebody would place the organ by eye: T_world_preoperative, with a known error.
  Eigen::Isometry3d roughPose() const;

  const Eigen::Isometry3d& cameraPose() const { return T_world_camera_; }
  double organExtent() const { return extent_; }                                 ///< [m]
  double cameraDistance() const { return settings_.camera_distance * extent_; }  ///< [m]

 private:
  SceneSettings settings_;
  Surface organ_;
  double extent_ = 0.0;
  Eigen::Isometry3d T_world_preoperative_, T_world_camera_;
  OrganMotion motion_;
};

}  // namespace unirit
