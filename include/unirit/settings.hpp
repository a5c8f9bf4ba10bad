// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace unirit {

/// What of the other cloud the network reads beside a point: in the non-rigid decoder of the
/// published layers, where those read the target's row, or everywhere. Checkpoints hold the number:
/// new ones come last.
enum class Pairing {
  kNearest,  ///< offset to the nearest target point: independent of the order of either cloud
  kNone,     ///< nothing, as in the Free Point Transformer
  kRow,      ///< row i of the target, as published; only to reproduce the published tables
  kOffsets,  ///< another network, the default: encoders and decoder read offsets to the nearest
             ///< points, either way, and their means over neighbourhoods
};

/// In their order. Before kRefine, kRigid gives it a second start and kNonRigid is not run.
enum class Stage { kRigid, kNonRigid, kRefine };

/// What a point of the intra-operative cloud is.
enum class Correspondence {
  kSurface,  ///< anywhere on the organ's surface
  kPoints,   ///< one of the pre-operative points, moved: tracked vertices, fiducials
};

/// How the intra-operative cloud is made ready. Lengths scale with the organ.
struct PreprocessingSettings {
  double margin = 0.0;  ///< kept around where the organ is expected, over its extent; 0: off
  double voxel = 0.01;  ///< edge of the voxels that keep one point each, over the same; 0: off
  double min_density = 0.05;  ///< points in and around a voxel over the median voxel's; 0: off
};

/// How the clouds are brought to the network.
struct SamplingSettings {
  int points = 1024;  ///< points kept of each cloud; smaller clouds are taken whole
};

/// How the network is run.
struct NetworkSettings {
  int rigid_iterations = 8;             ///< n of the paper's rigid module; of the flow at most
  Pairing pairing = Pairing::kOffsets;  ///< must be the one the weights were trained with
};

/// The coherent refinement. Lengths scale with the organ.
struct RefinementSettings {
  Correspondence correspondence = Correspondence::kSurface;
  int pose_iterations = 16;  ///< of the pose alone, with few points
  int iterations = 16;       ///< of pose and displacement, half of them with few points
  int warm_iterations = 8;   ///< of both, where they begin at the registration before
  double last_sigma = 0.02;  ///< deviation of the cloud from the surface at the end, over the
                             ///< organ's half extent
};

/// Limits outside of which a registration is refused. Lengths relative to the organ's extent hold
/// for organs of any size.
struct PlausibilitySettings {
  int min_points = 50;              ///< points in either cloud, after invalid ones are dropped
  double min_thickness = 0.005;     ///< second and third principal deviation over the first
  double min_organ_extent = 0.01;   ///< of the pre-operative cloud [m]
  double max_organ_extent = 1.0;    ///< same, from above [m]
  double min_extent_ratio = 0.1;    ///< extent of the intra-operative cloud over the organ's
  double max_extent_ratio = 3.0;    ///< same, from above
  double min_overlap = 0.363;       ///< share of the cloud within a tenth of the extent of where
                                    ///< the start has the organ
  double inlier_tolerance = 0.005;  ///< cloud points nearer than this are inliers [m]
  double max_residual = 0.06;       ///< median distance of cloud to moved surface, over extent
  double max_residual_p95 = 0.108;  ///< same, 95th percentile
  double min_inliers = 0.2;         ///< share of inliers in the cloud
  double max_residual_left = 1.22;  ///< RefinementQuality::residual_left
  double max_missing = 0.15;        ///< RefinementQuality::missing
  double min_confidence = 0.24;     ///< RefinementQuality::confidence
  double max_surprise = 1.29;       ///< RefinementQuality::surprise
  double max_flip_gain = 0.244;     ///< RefinementQuality::flip_gain
  double max_displacement = 0.23;   ///< largest non-rigid displacement, over extent
  double max_stretch = 2.34;        ///< DisplacementStatistics::stretch
  double min_compression = 0.17;    ///< DisplacementStatistics::compression
  double max_folded = 0.05;         ///< DisplacementStatistics::folded_fraction
  double max_turn = 60.0;           ///< of the organ from the start [degree]
  double max_joint = 0.58;          ///< root mean square of turn, 95th percentile of the residual,
                                    ///< displacement, missing, confidence and surprise, over limits
  double max_jump_translation = 0.10;  ///< from the last accepted pose, at the organ's centroid [m]
  double max_jump_rotation = 60.0;     ///< from the last accepted pose [degree]
};

/// Everything the core can be told.
struct RegistrationSettings {
  std::vector<Stage> stages{Stage::kRigid, Stage::kNonRigid, Stage::kRefine};
  PreprocessingSettings preprocessing;  ///< heeded by preprocess, not by the Registrar
  SamplingSettings sampling;
  NetworkSettings network;
  RefinementSettings refinement;
  PlausibilitySettings plausibility;
  int threads = 2;  ///< worker threads of the network; the result has the same bits for any number

  bool runs(Stage stage) const;  ///< whether the stage is among the chosen
};

const char* toString(Pairing pairing);
const char* toString(Correspondence correspondence);
const char* toString(Stage stage);

/// A setting that is a word, or several.
struct WordSetting {
  const char* name;  ///< as in YAML files and ROS parameters
  std::string (*get)(const RegistrationSettings&);
  void (*set)(RegistrationSettings&, const std::string&);  ///< throws std::invalid_argument
};

/// All of them; visitSettings has the numbers.
const std::vector<WordSetting>& wordSettings();

/// Parse the names that toString gives. Throw std::invalid_argument naming the unknown word.
Pairing pairingFromString(const std::string& name);
Correspondence correspondenceFromString(const std::string& name);
std::vector<Stage> stagesFromString(const std::string& comma_separated);
std::string toString(const std::vector<Stage>& stages);

/// The one list of settings: calls visitor(name, value, minimum, maximum, description) for every
/// number. YAML files, ROS parameters, dynamic_reconfigure and the settings' hash are read off it.
template <class Settings, class Visitor>
void visitSettings(Settings& settings, Visitor&& visitor) {
  auto& p = settings.plausibility;
  visitor("threads", settings.threads, 1, 64, "worker threads of the network");
  auto& c = settings.preprocessing;
  visitor("preprocessing/margin", c.margin, 0.0, 10.0,
          "kept around where the organ is expected, over its extent; 0: off");
  visitor("preprocessing/voxel", c.voxel, 0.0, 0.1,
          "edge of the voxels that keep one point each, over the organ's extent; 0: off");
  visitor("preprocessing/min_density", c.min_density, 0.0, 1.0,
          "points in and around a voxel over the median voxel's, at least; 0: off");
  visitor("sampling/points", settings.sampling.points, 64, 16384, "points kept of each cloud");
  visitor("network/rigid_iterations", settings.network.rigid_iterations, 1, 32,
          "iterations of the rigid stage; with pairing offsets at most");
  auto& r = settings.refinement;
  visitor("refinement/pose_iterations", r.pose_iterations, 0, 100,
          "iterations of the pose alone, with few points");
  visitor("refinement/iterations", r.iterations, 1, 200,
          "iterations of pose and displacement, half of them with few points");
  visitor("refinement/warm_iterations", r.warm_iterations, 1, 200,
          "iterations of both, where they begin at the registration before");
  visitor("refinement/last_sigma", r.last_sigma, 0.002, 0.1,
          "deviation of the cloud from the surface at the end, over the organ's half extent");
  visitor("plausibility/min_points", p.min_points, 4, 100000, "fewest points in either cloud");
  visitor("plausibility/min_thickness", p.min_thickness, 0.0, 1.0,
          "second and third principal deviation over the first, at least");
  visitor("plausibility/min_organ_extent", p.min_organ_extent, 0.0, 1.0,
          "extent of the pre-operative cloud, at least [m]");
  visitor("plausibility/max_organ_extent", p.max_organ_extent, 0.01, 1000.0,
          "extent of the pre-operative cloud, at most [m]");
  visitor("plausibility/min_extent_ratio", p.min_extent_ratio, 0.0, 1.0,
          "extent of the cloud over the organ's, at least");
  visitor("plausibility/max_extent_ratio", p.max_extent_ratio, 1.0, 100.0,
          "extent of the cloud over the organ's, at most");
  visitor("plausibility/min_overlap", p.min_overlap, 0.0, 1.0,
          "share of the cloud within a tenth of the extent of where the start has the organ");
  visitor("plausibility/inlier_tolerance", p.inlier_tolerance, 0.0, 0.1,
          "cloud points nearer to the moved surface than this are inliers [m]");
  visitor("plausibility/max_residual", p.max_residual, 0.0, 1.0,
          "median distance of the cloud to the moved surface over the organ's extent, at most");
  visitor("plausibility/max_residual_p95", p.max_residual_p95, 0.0, 1.0,
          "95th percentile of the same, at most");
  visitor("plausibility/min_inliers", p.min_inliers, 0.0, 1.0, "share of inliers, at least");
  visitor("plausibility/max_residual_left", p.max_residual_left, 0.0, 10.0,
          "residual over that of the rigid part alone, at most");
  visitor("plausibility/max_missing", p.max_missing, 0.0, 1.0,
          "share of the organ's side in view without a cloud point nearby, at most");
  visitor("plausibility/min_confidence", p.min_confidence, 0.0, 1.0,
          "mean confidence over the organ, at least");
  visitor("plausibility/max_surprise", p.max_surprise, 0.0, 10.0,
          "length of the refined displacement over the length expected, at most");
  visitor("plausibility/max_flip_gain", p.max_flip_gain, 0.0, 10.0,
          "gain in fit where the organ is flipped, half a turn about a principal axis, at most");
  visitor("plausibility/max_displacement", p.max_displacement, 0.0, 2.0,
          "largest non-rigid displacement over the organ's extent, at most");
  visitor("plausibility/max_stretch", p.max_stretch, 1.0, 100.0,
          "largest principal stretch, 95th percentile over the organ, at most");
  visitor("plausibility/min_compression", p.min_compression, 0.0, 1.0,
          "smallest principal stretch, 5th percentile over the organ, at least");
  visitor("plausibility/max_folded", p.max_folded, 0.0, 1.0,
          "share of the organ where the deformation folds, at most");
  visitor("plausibility/max_turn", p.max_turn, 0.0, 180.0,
          "rotation from the start, at most [degree]");
  visitor(
      "plausibility/max_joint", p.max_joint, 0.0, 10.0,
      "root mean square of turn, residual, displacement, missing, confidence and surprise, each "
      "over its limit");
  visitor("plausibility/max_jump_translation", p.max_jump_translation, 0.0, 10.0,
          "translation from the last accepted pose at the organ's centroid, at most [m]");
  visitor("plausibility/max_jump_rotation", p.max_jump_rotation, 0.0, 180.0,
          "rotation from the last accepted pose, at most [degree]");
}

/// Throws std::invalid_argument naming the first setting outside its range, its value and the
/// range.
void validate(const RegistrationSettings& settings);

/// Settings as a flat JSON object of the names above (plus stages, pairing); what result files
/// carry.
std::string toJson(const RegistrationSettings& settings);

/// SHA-256 (hex) of toJson.
std::string sha256(const RegistrationSettings& settings);

}  // namespace unirit
