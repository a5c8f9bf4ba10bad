// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "unirit/settings.hpp"

namespace unirit::test {

/// Limits on a registration's outcome that none exceeds; what is asked of the input stays.
inline PlausibilitySettings lenientLimits() {
  RegistrationSettings settings;
  bool of_outcome = false;  // the settings' list has those of the input first
  visitSettings(settings, [&](const std::string& name, auto& value, auto least, auto most, auto) {
    of_outcome = of_outcome || name == "plausibility/max_residual";
    if (!of_outcome) return;
    if (name.rfind("plausibility/max_", 0) == 0) value = most;
    if (name.rfind("plausibility/min_", 0) == 0) value = least;
  });
  settings.plausibility.min_overlap = 0.0;
  return settings.plausibility;
}

}  // namespace unirit::test
