// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// A pinhole depth camera in its optical frame (REP-103: x right, y down, z forward).
struct DepthCamera {
  int width = 320;                 ///< [pixel]
  int height = 240;                ///< [pixel]
  double horizontal_field = 60.0;  ///< field of view [degree]
  double min_range = 0.02;         ///< least depth (z) that is measured [m]
  double max_range = 2.0;          ///< largest depth (z) that is measured [m]
  double depth_noise = 0.001;      ///< standard deviation along the ray [m]
  double outlier_fraction = 0.0;   ///< share of points that show a random depth near the organ
};

/// What the camera sees of a mesh: one point a pixel whose ray meets it, in the camera's optical
/// frame, without normals. Hidden parts, the far side and what lies outside the field of view or
/// the range are missing; what is too near still hides what is behind it. Faces are seen from both
/// sides. Deterministic for a seed. Throws std::invalid_argument on a mesh without faces, a face
/// without vertices or parameters out of range.
PointCloud renderDepth(const Surface& mesh, const Eigen::Isometry3d& T_camera_mesh,
                       const DepthCamera& camera, std::uint64_t seed);

/// Pose of a camera at `eye` that looks at `centre`, its image's x axis square to `up`:
/// T_world_camera. Throws std::invalid_argument where the three leave the pose open.
Eigen::Isometry3d lookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& centre,
                         const Eigen::Vector3d& up);

}  // namespace unirit
