// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "unirit/evaluation/pair.hpp"
#include "unirit/registration.hpp"

namespace unirit {

/// How far a registration of a pair is from the truth.
struct RegistrationErrors {
  bool refused = false;      ///< not succeeded: counts with its start
  double before = 0.0;       ///< RMS to the true positions at the start [m]
  double best_rigid = 0.0;   ///< same, after the best rigid fit with true rows: an oracle
  double rigid = 0.0;        ///< same, after the rigid stage
  double final = 0.0;        ///< same, after all stages
  double pose_before = 0.0;  ///< RMS distance of the start to the best rigid fit [m]
  double pose = 0.0;         ///< RMS distance of the rigid stage to the best rigid fit [m]
  double rotation = 0.0;     ///< of the rigid stage against the best rigid fit [degree]
  double translation = 0.0;  ///< same, at the organ's centroid [m]
};

/// Registers the pair from `start` and compares with what is known.
RegistrationErrors registrationErrors(Registrar& registrar, const RegistrationPair& pair,
                                      const Eigen::Isometry3d& start);

}  // namespace unirit
