// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/status.hpp"

namespace unirit {

const char* toString(Status status) {
  switch (status) {
    case Status::kSucceeded:
      return "SUCCEEDED";
    case Status::kRefused:
      return "REFUSED";
    case Status::kInvalidInput:
      return "INVALID_INPUT";
    case Status::kNoTransform:
      return "NO_TRANSFORM";
    case Status::kFailed:
      return "FAILED";
    case Status::kStale:
      return "STALE";
  }
  return "UNKNOWN";
}

}  // namespace unirit
