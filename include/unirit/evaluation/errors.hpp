// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "unirit/evaluation/method.hpp"

namespace unirit {

/// How far a method's answer is from the truth. Metres and degrees.
struct RegistrationErrors {
  bool refused = false;     ///< the errors below are then those of the start
  double before = 0.0;      ///< RMS of source points to their true positions, unmoved
  double best_rigid = 0.0;  ///< same, after the best rigid fit with true rows: an oracle
  double rmse = 0.0;        ///< same, moved by the method
  double p95 = 0.0;         ///< 95th percentile of the same distances
  double chamfer = 0.0;     ///< moved source and target: half the sum of the two mean distances
  double chamfer_squared = 0.0;  ///< sum of the two mean squared distances, as the paper prints it

  std::optional<double> surface;  ///< RMS of moved source points to the true surface's samples
  std::optional<double> target;   ///< RMS of interior points to their true positions

  // Where the method has a pose, against the best rigid fit:
  std::optional<double> rotation;     ///< [degree]
  std::optional<double> translation;  ///< at the source's centroid
  std::optional<double> pose;         ///< RMS distance of the posed source points

  bool worse() const { return rmse > before; }
};

/// Throws std::invalid_argument where the result has not as many points as the pair.
RegistrationErrors registrationErrors(const RegistrationPair& pair, const MethodResult& result);

}  // namespace unirit
