// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <unirit/RegistrationResult.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "unirit/preprocessing.hpp"
#include "unirit/registration.hpp"

namespace unirit {

/// Fills in what the core found; header, id, frames, start and hashes stay as they are.
void fillIn(const Registration& registration, double inlier_tolerance, RegistrationResult& result);

/// Fills in what the preprocessing left of the cloud.
void fillIn(const std::vector<StagePoints>& preprocessing, RegistrationResult& result);

/// Pose as a transform, its quaternion renormalised. Throws Refusal (INVALID_INPUT) with a sentence
/// that begins with `name` where it is not finite or its quaternion is not nearly of unit length.
Eigen::Isometry3d fromMessage(const geometry_msgs::Pose& pose, const std::string& name);

/// Transform with its rotation made a unit quaternion.
geometry_msgs::Transform toMessage(const Eigen::Isometry3d& transform);

}  // namespace unirit
