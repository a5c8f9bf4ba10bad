// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "unirit/settings.hpp"

namespace unirit {

/// Overwrites the settings that a YAML file names, as config/unirit.yaml does, nested or joined
/// ("plausibility/min_points"); what belongs to the ROS node alone is passed over. Throws
/// std::runtime_error naming the file and the key that is unknown, of the wrong type or out of
/// range, and then leaves the settings as they were.
void readSettings(const std::string& path, RegistrationSettings& settings);

}  // namespace unirit
