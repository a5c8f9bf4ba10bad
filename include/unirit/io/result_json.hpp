// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "unirit/preprocessing.hpp"
#include "unirit/registration.hpp"

namespace unirit {

/// What a result says of its inputs beside what the registration found.
struct ResultOrigin {
  std::string preoperative_frame;    ///< or the name of the pre-operative file
  std::string intraoperative_frame;  ///< or the name of the intra-operative file
  std::string start;                 ///< where the registration began, such as "centroids"
  std::vector<StagePoints> preprocessing;
  double inlier_tolerance = 0.0;  ///< [m]
  std::string weights_sha256;
  std::string settings_sha256;
};

/// The fields of RegistrationResult.msg, by their names and in SI units, as a JSON text. What is
/// not finite becomes null.
std::string toJson(const Registration& registration, const ResultOrigin& origin);

}  // namespace unirit
