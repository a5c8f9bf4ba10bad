// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

#include "unirit/status.hpp"

namespace unirit {

/// Ends an attempt early: a status and the sentence that goes into its result. Caught by the
/// worker; never leaves a callback.
class Refusal : public std::runtime_error {
 public:
  Refusal(Status status, const std::string& sentence)
      : std::runtime_error(sentence), status_(status) {}
  Status status() const { return status_; }

 private:
  Status status_;
};

}  // namespace unirit
