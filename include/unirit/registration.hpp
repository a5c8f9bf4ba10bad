// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "unirit/deformation.hpp"
#include "unirit/metrics.hpp"
#include "unirit/network/network.hpp"
#include "unirit/point_cloud.hpp"
#include "unirit/settings.hpp"
#include "unirit/status.hpp"

namespace unirit {

struct StageTime {
  std::string stage;
  double milliseconds = 0.0;
};

/// How well the refinement explains the seen cloud. Dimensionless; of 1000 points each.
struct RefinementQuality {
  double fit = 0.0;       ///< mean log likelihood of seen and of visible points, up to constants
  double surprise = 0.0;  ///< of the displacement under its prior: its length over the length that
                          ///< is expected of what the cloud could show of it, in deviations
  double missing = 0.0;   ///< share of what the viewpoint should see of the organ (all of it where
                          ///< the whole was seen) without a cloud point within 0.05 of the extent
  double confidence = 0.0;     ///< DisplacementField::confidence, mean over the organ
  double residual_left = 1.0;  ///< RMS distance of the cloud to the moved organ over that to the
                               ///< rigidly moved one: below 1 the displacement gained something
  /// What the fit of the undisplaced organ gains where it is flipped, half a turn about a principal
  /// axis: above 0 it may lie upside down. Not where the search began at an earlier registration.
  std::optional<double> flip_gain = std::nullopt;
};

/// What a registration found, and how far it can be believed.
struct Registration {
  Status status = Status::kFailed;
  std::string message;  ///< one sentence, names the cause
  /// Rigid part, pre-operative to intra-operative frame; identity unless succeeded or refused.
  Eigen::Isometry3d T_intraoperative_preoperative = Eigen::Isometry3d::Identity();
  /// The guess for the next view of a stream: this one's, moved by what of the pose lies beyond the
  /// deviations that are expected of it. Followed further, errors would add up.
  Eigen::Isometry3d next_guess = Eigen::Isometry3d::Identity();
  /// What the refinement's fit should be near in the next view of a stream: the best since the
  /// organ was last searched for from afar.
  std::optional<double> next_fit = std::nullopt;
  std::shared_ptr<const Deformation> deformation;  ///< null unless succeeded or refused
  SurfaceResidual residual;                        ///< moved surface against the cloud
  DisplacementStatistics displacement;             ///< non-rigid part over the organ
  /// Where the refinement ran on surfaces; matched points leave less doubt.
  std::optional<RefinementQuality> refinement;
  std::vector<PlausibilityCheck> checks;
  std::vector<StageTime> stages;

  bool succeeded() const { return status == Status::kSucceeded; }
};

/// What was found a moment ago for the same organ.
struct Earlier {
  Eigen::Isometry3d T_intraoperative_preoperative;  ///< to the present intra-operative frame
  std::shared_ptr<const Deformation> deformation;   ///< in its own one
  /// Registration::next_fit; where it is not known, a poor fit alone starts a whole search.
  std::optional<double> fit = std::nullopt;
};

/// Registers a pre-operative surface to an intra-operative cloud: the page a user of the library
/// reads. Keeps buffers and the sampled organ between calls, so use one Registrar per thread.
class Registrar {
 public:
  /// Throws std::invalid_argument where settings are out of range or do not fit the weights.
  Registrar(std::shared_ptr<const Weights> weights, const RegistrationSettings& settings);
  ~Registrar();

  /// `guess` takes the pre-operative frame to the intra-operative one. Clouds may have any number
  /// of points, in any order; points that are not finite are dropped. `earlier`: where the
  /// refinement begins, which then is short, and is followed by a whole one from the guess only
  /// where the fit is poor and clearly worse than the earlier one's; the pose is still expected
  /// about the guess, so that errors do not add up over a stream of views. Never throws on bad
  /// clouds: the status and sentence say what is wrong.
  Registration registerClouds(const PointCloud& preoperative, const PointCloud& intraoperative,
                              const Eigen::Isometry3d& guess, const Earlier* earlier = nullptr);

  const RegistrationSettings& settings() const;

  /// New settings for the next call; throws as the constructor does, and then keeps the old ones.
  void setSettings(const RegistrationSettings& settings);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// A start for clouds whose frames have nothing in common: the translation between centroids.
Eigen::Isometry3d alignCentroids(const PointCloud& preoperative, const PointCloud& intraoperative);

}  // namespace unirit
