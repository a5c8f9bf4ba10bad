// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace unirit {

/// How a registration ended; the numbers are those of RegistrationResult.msg.
enum class Status : std::uint8_t {
  kSucceeded = 0,
  kRefused = 1,       ///< a plausibility check failed
  kInvalidInput = 2,  ///< the message names the offending input
  kNoTransform = 3,   ///< a frame could not be looked up
  kFailed = 4,        ///< internal error
  kStale = 5,         ///< the accepted registration has outlived its time
};

/// "SUCCEEDED", "REFUSED", ...: the constants' names in RegistrationResult.msg.
const char* toString(Status status);

/// One plausibility check: what was measured, against which limit. (unirit::Check is the message.)
struct PlausibilityCheck {
  std::string name;
  double value = 0.0;
  double limit = 0.0;
  bool passed = true;
  bool at_least = false;  ///< the limit is the smallest value that passes, else the largest
};

}  // namespace unirit
