// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unirit/RegistrationResult.h>
#include <visualization_msgs/Marker.h>

#include <string>

namespace unirit {

/// RMS distance of the organ's points to where they truly are [m].
struct TrueErrors {
  double before = 0.0;    ///< as shown before this registration
  double rigid = 0.0;     ///< moved by the rigid part alone
  double deformed = 0.0;  ///< moved by the whole registration
};

/// What a demonstration came to.
struct Tally {
  int registrations = 0;
  int succeeded = 0;
  TrueErrors sum;  ///< over the succeeded ones

  void add(const RegistrationResult& result, const TrueErrors& errors);
};

/// One line about a registration; the errors only stand for something where it succeeded.
std::string describe(const RegistrationResult& result, const TrueErrors& errors);
std::string describe(const Tally& tally);

/// Text to stand `height` [m] tall at a place in the world, green where the registration succeeded.
visualization_msgs::Marker statusText(const RegistrationResult& result, const TrueErrors& errors,
                                      double height);

}  // namespace unirit
