// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "unirit/evaluation/pair.hpp"

namespace unirit {

/// What a registration is given on purpose; docs/refusals.md describes each.
enum class TrialKind {
  kOrdinary,    ///< the organ's own cloud, as the ordinary protocols make it
  kOtherOrgan,  ///< the cloud of an organ of another class
  kTableTop,    ///< a noisy plane, bare or with objects on it
  kWrongUnit,   ///< the cloud, the organ or both, 100 or 1000 times too large or too small
  kFarStart,    ///< the organ's own cloud, turned by 60 to 180 degrees
  kSmallView,   ///< a tenth of the organ's surface in view
  kHalfOther,   ///< one half of the cloud is another organ's
};

/// Those that ordinary trials take turns with.
const std::vector<Protocol>& ordinaryProtocols();

const std::vector<TrialKind>& trialKinds();
const char* toString(TrialKind kind);

/// A registration that should succeed, or one that should be refused.
struct Trial {
  TrialKind kind = TrialKind::kOrdinary;
  Protocol protocol = Protocol::kResampled;  ///< that the cloud was seen under
  PointCloud preoperative;
  PointCloud intraoperative;
  Eigen::Isometry3d guess = Eigen::Isometry3d::Identity();
  Points truth;  ///< where the pre-operative points truly went; empty: no answer is right

  /// RMS distance to the truth before registration, over the organ's extent.
  double errorBefore() const;
  /// Same, of moved pre-operative points.
  double error(const Points& moved) const;
  /// Whether they may be shown to a user: there is a truth, they lie within a tenth of the extent
  /// of it, and no more than a tenth farther from it than the start.
  bool isRight(const Points& moved) const;
};

/// The `number`-th trial of its kind; protocols, units and angles take turns with it. `other` is
/// of another class. `points` of either cloud. Deterministic for a seed.
Trial makeTrial(TrialKind kind, int number, const DeformedOrgan& own, const DeformedOrgan& other,
                Eigen::Index points, std::uint64_t seed);

}  // namespace unirit
