// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/baselines.hpp"

#include <algorithm>

namespace unirit {
namespace {

/// A method is timed on one thread, and networks are run as they were trained.
RegistrationSettings forWeights(const Weights& weights, RegistrationSettings settings) {
  settings.threads = 1;
  settings.network.pairing = weights.pairing;
  return settings;
}

}  // namespace

MethodResult movedRigidly(const RegistrationPair& pair, const Eigen::Isometry3d& pose) {
  return {false, moved(pose, pair.source), moved(pose, pair.interior), pose};
}

MethodResult Identity::registerPair(const RegistrationPair& pair) {
  return movedRigidly(pair, Eigen::Isometry3d::Identity());
}

MethodResult BestRigidOracle::registerPair(const RegistrationPair& pair) {
  return movedRigidly(pair, pair.best_rigid);
}

Unirit::Unirit(std::shared_ptr<const Weights> weights, const RegistrationSettings& settings,
               bool align_centroids)
    : weights_hash_(weights->sha256),
      align_centroids_(align_centroids),
      registrar_(weights, forWeights(*weights, settings)) {}

std::string Unirit::name() const {
  std::string stages = toString(registrar_.settings().stages);
  std::replace(stages.begin(), stages.end(), ',', '+');
  return "unirit " + stages;
}

std::string Unirit::parameters() const {
  return "weights=" + weights_hash_ + ":settings=" + sha256(registrar_.settings()) +
         ":start=" + (align_centroids_ ? "centroids" : "identity");
}

MethodResult Unirit::registerPair(const RegistrationPair& pair) {
  const PointCloud source{pair.source, pair.source_normals};
  const PointCloud target{pair.target, Points(), pair.viewpoint};
  const Eigen::Isometry3d start =
      align_centroids_ ? alignCentroids(source, target) : Eigen::Isometry3d::Identity();
  const Registration registration = registrar_.registerClouds(source, target, start);
  if (!registration.succeeded()) {
    MethodResult result = movedRigidly(pair, start);
    result.refused = true;
    return result;
  }
  const Deformation& deformation = *registration.deformation;
  return {false, deformation.movedSurface(), deformation.move(pair.interior),
          registration.T_intraoperative_preoperative, deformation.deviations()};
}

UniritByRows::UniritByRows(std::shared_ptr<const Weights> weights)
    : network_(weights, {NetworkSettings().rigid_iterations, Pairing::kRow}, 1) {}

std::string UniritByRows::parameters() const { return "weights=" + network_.weights().sha256; }

MethodResult UniritByRows::registerPair(const RegistrationPair& pair) {
  const Normalisation unit = Normalisation::of(pair.source);
  const Points source = unit.apply(pair.source), target = unit.apply(pair.target);
  const Eigen::Isometry3f pose = network_.estimateRigid(source, target);
  const Points moved = pose * source;
  const Points deformed = moved + network_.estimateDisplacements(moved, target, moved);
  const auto toMetres = [&](const Points& points) -> Points {
    return (points * unit.scale).colwise() + unit.offset;
  };
  return {false, toMetres(deformed), toMetres(pose * unit.apply(pair.interior)), std::nullopt};
}

}  // namespace unirit
