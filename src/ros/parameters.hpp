// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/node_handle.h>
#include <unirit/UniritConfig.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "unirit/settings.hpp"

namespace unirit {

/// What the node is told beyond the registration's own settings; config/unirit.yaml describes each.
struct NodeSettings {
  std::string weights;         ///< path of the weights file
  bool auto_register = false;  ///< register every cloud; off: by the service only
  bool every_cloud = false;    ///< each cloud in order, none dropped; off: the newest wins
  double stale_after = 10.0;   ///< age at which an accepted registration is withdrawn [s]
  std::optional<Eigen::Isometry3d> initial_pose;  ///< T_fixed_preoperative
  std::string initial_alignment = "centroid";     ///< centroid or none
  std::optional<Eigen::AlignedBox3d> region;      ///< crops the cloud; nothing: everything [m]
  std::string region_frame;                       ///< of the region; empty: the cloud's own
  std::string fixed_frame;   ///< does not move with the camera; empty: the camera stands still
  std::string sensor_frame;  ///< of the camera; empty: the cloud's own frame; none: there is none
  bool publish_tf = true;
  bool invert_tf = false;
  double tf_rate = 20.0;    ///< [Hz]
  double tf_timeout = 0.5;  ///< wait for a transform at a cloud's stamp, at most [s]
};

/// Parameters as read once at start, and a sentence for each that cannot be used. A node with
/// faults stays alive and refuses to register: a limit that was mistyped, in value or name, must
/// not fall back to a default unseen. An unknown name that resembles none of the node's, and so may
/// be somebody else's, is only warned of.
struct Parameters {
  RegistrationSettings registration;
  NodeSettings node;
  std::vector<std::string> faults;
  std::vector<std::string> warnings;
};

Parameters readParameters(const ros::NodeHandle& private_nh);

/// The thresholds that dynamic_reconfigure holds.
PlausibilitySettings fromConfig(const UniritConfig& config);

}  // namespace unirit
