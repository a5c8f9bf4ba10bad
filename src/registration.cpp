// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/registration.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include "organ_model.hpp"
#include "refinement/coherent_field.hpp"
#include "unirit/plausibility.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

// Of Refined::fit, found on training organs with 1024 points
constexpr double kPoorFit = -5.4;
constexpr double kClearlyBetterWhole = 0.2;
constexpr double kClearlyBetterView = 0.5;  // any pose of a part of the organ fits almost as well
constexpr double kClearlyWorse = 0.3;       // in a stream, than its best view

PointCloud dropInvalid(const PointCloud& cloud) {
  if (cloud.points.allFinite()) return cloud;
  std::vector<Eigen::Index> valid;
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    if (cloud.points.col(i).allFinite()) valid.push_back(i);
  }
  return {select(cloud.points, valid),
          cloud.normals.cols() == 0 ? Points() : select(cloud.normals, valid), cloud.viewpoint};
}

/// Runs a stage, or more of it, and notes how long it took.
template <class Work>
void timed(const char* stage, std::vector<StageTime>& stages, Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - start;
  const auto known = std::find_if(stages.begin(), stages.end(),
                                  [&](const StageTime& time) { return time.stage == stage; });
  if (known == stages.end()) {
    stages.push_back({stage, elapsed.count()});
  } else {
    known->milliseconds += elapsed.count();
  }
}

Registration ended(Status status, std::string message, std::vector<PlausibilityCheck> checks = {}) {
  Registration registration;
  registration.status = status;
  registration.message = std::move(message);
  registration.checks = std::move(checks);
  return registration;
}

/// Of the prior's variance of 1 a coefficient, what is not left after the cloud was seen.
double surprise(const Refined& refined) {
  const auto prior = static_cast<double>(refined.coefficients.size());
  const double learnt = prior - static_cast<double>(refined.covariance_factor.squaredNorm());
  return refined.coefficients.norm() / std::sqrt(std::max(learnt, 1.0));
}

/// What a refinement must reach to be the last.
double sufficientFit(const Earlier* earlier) {
  if (earlier == nullptr || !earlier->fit) return kPoorFit;
  return std::min(kPoorFit, *earlier->fit - kClearlyWorse);
}

void keepBetter(const Refined& other, bool whole, std::optional<Refined>& refined) {
  const double margin = whole ? kClearlyBetterWhole : kClearlyBetterView;
  if (!refined || other.fit > refined->fit + margin) refined = other;
}

}  // namespace

struct Registrar::Implementation {
  /// In the network's unit and the organ's frame, as the guess has it.
  struct Found {
    Eigen::Isometry3f rigid = Eigen::Isometry3f::Identity();
    Points displacements;  // of the network, at every point of the organ
    Sighting sighting;
    std::optional<Refined> refined;  // takes the place of the displacements
    std::optional<double> next_fit;
  };

  Implementation(std::shared_ptr<const Weights> new_weights,
                 const RegistrationSettings& new_settings)
      : weights(std::move(new_weights)),
        settings(new_settings),
        network(weights, settings.network, settings.threads),
        team(settings.threads) {}

  Registration run(const PointCloud& preoperative, const PointCloud& intraoperative,
                   const Eigen::Isometry3d& guess, const Earlier* earlier);
  Found searchByNetwork(const Points& target, std::vector<StageTime>& stages);
  Found searchByRefinement(const PointCloud& target, const Eigen::Isometry3d& guess,
                           const Earlier* earlier, std::vector<StageTime>& stages);
  void describe(const Found& found, const Eigen::Isometry3d& guess,
                const PointCloud& intraoperative, Registration& registration);
  void judge(const Found& found, const Points& target, const Eigen::Isometry3d& guess,
             const Earlier* earlier, Registration& registration);

  Refined refineFrom(const Eigen::Isometry3f& start, const Sighting& sighting);
  Refined refineFromEarlier(const Sighting& sighting, const Eigen::Isometry3d& guess,
                            const Earlier& earlier);
  RefinementQuality qualityOf(const Found& found, const Deformation& deformation, bool cold);
  Eigen::Isometry3f startOf(const Eigen::Isometry3d& guess, const Earlier* earlier) const;
  std::shared_ptr<const Deformation> deformationOf(const Found& found,
                                                   const Eigen::Isometry3d& pose,
                                                   const Eigen::Matrix3f& turn);

  std::shared_ptr<const Weights> weights;
  RegistrationSettings settings;
  Network network;
  ThreadTeam team;  // the refinement's
  std::unique_ptr<OrganModel> model;
};

/// The paper's figure: sample, normalise, move rigidly, displace, map back to metres.
Registration Registrar::Implementation::run(const PointCloud& preoperative,
                                            const PointCloud& intraoperative,
                                            const Eigen::Isometry3d& guess,
                                            const Earlier* earlier) {
  Registration registration = ended(Status::kSucceeded, "registered");
  PointCloud target;  // the seen cloud, in the organ's frame
  timed("sampling", registration.stages, [&] {
    if (!model || !model->isOf(preoperative)) {
      model = std::make_unique<OrganModel>(preoperative, settings, team);
    }
    target = model->sample(intraoperative, guess.inverse());
  });
  const Found found = settings.runs(Stage::kRefine)
                          ? searchByRefinement(target, guess, earlier, registration.stages)
                          : searchByNetwork(target.points, registration.stages);
  timed("assessment", registration.stages, [&] {
    describe(found, guess, intraoperative, registration);
    judge(found, target.points, guess, earlier, registration);
  });
  return registration;
}

/// The paper's two stages.
Registrar::Implementation::Found Registrar::Implementation::searchByNetwork(
    const Points& target, std::vector<StageTime>& stages) {
  Found found;
  const Points& source = model->sampled.points;
  if (settings.runs(Stage::kRigid)) {
    timed("rigid", stages, [&] { found.rigid = network.estimateRigid(source, target); });
  }
  found.displacements.setZero(3, model->vertices.cols());
  if (settings.runs(Stage::kNonRigid)) {
    timed("nonrigid", stages, [&] {
      found.displacements = network.estimateDisplacements(found.rigid * source, target,
                                                          found.rigid * model->vertices);
    });
  }
  return found;
}

/// From what was found earlier, if anything was; where that does not suffice from the guess, and
/// then from where the network moves the organ rigidly. Beginning from its displacement as well, or
/// from its fine iteration, was not more accurate.
Registrar::Implementation::Found Registrar::Implementation::searchByRefinement(
    const PointCloud& target, const Eigen::Isometry3d& guess, const Earlier* earlier,
    std::vector<StageTime>& stages) {
  Found found;
  const auto suffices = [&] {
    return found.refined && found.refined->fit >= sufficientFit(earlier);
  };
  const auto searchFrom = [&](const Eigen::Isometry3f& start) {
    keepBetter(refineFrom(start, found.sighting), found.sighting.whole, found.refined);
  };
  bool searched = false;
  timed("refine", stages, [&] {
    found.sighting = model->refinement->sight(target);
    if (earlier != nullptr) found.refined = refineFromEarlier(found.sighting, guess, *earlier);
    searched = !suffices();
    if (searched) searchFrom(Eigen::Isometry3f::Identity());
  });
  if (settings.runs(Stage::kRigid) && !suffices()) {
    Eigen::Isometry3f start = Eigen::Isometry3f::Identity();
    timed("rigid", stages,
          [&] { start = network.estimateRigidCoarsely(model->sampled.points, target.points); });
    timed("refine", stages, [&] { searchFrom(start); });
  }
  found.rigid = found.refined->pose;
  found.next_fit = searched
                       ? found.refined->fit
                       : std::max(found.refined->fit, earlier->fit.value_or(found.refined->fit));
  return found;
}

/// What was found, in metres, and how it compares with the cloud.
void Registrar::Implementation::describe(const Found& found, const Eigen::Isometry3d& guess,
                                         const PointCloud& intraoperative,
                                         Registration& registration) {
  const Eigen::Isometry3d pose = guess * model->toMetres(found.rigid);
  registration.T_intraoperative_preoperative = pose;
  registration.next_guess = guess * model->toMetres(beyondExpectation(found.rigid));
  registration.next_fit = found.next_fit;
  registration.deformation = deformationOf(found, pose, guess.linear().cast<float>());
  const Deformation& deformation = *registration.deformation;
  registration.residual = surfaceResidual(deformation.movedSurface(), intraoperative.points,
                                          settings.plausibility.inlier_tolerance);
  registration.displacement =
      displacementStatistics(deformation.displacements(), deformation.jacobians(model->samples));
}

void Registrar::Implementation::judge(const Found& found, const Points& target,
                                      const Eigen::Isometry3d& guess, const Earlier* earlier,
                                      Registration& registration) {
  if (found.refined && settings.refinement.correspondence == Correspondence::kSurface) {
    registration.refinement = qualityOf(found, *registration.deformation, earlier == nullptr);
  }
  const Eigen::Isometry3d start =
      earlier == nullptr ? guess : earlier->T_intraoperative_preoperative;
  applyChecks({checkOverlap(startOf(guess, earlier) * model->sampled.points, target,
                            model->extent / model->normalisation.scale, settings.plausibility)},
              registration);
  applyChecks(checkOutput(registration, start, model->extent, settings.plausibility), registration);
}

/// The refinement from a pose, and about it.
Refined Registrar::Implementation::refineFrom(const Eigen::Isometry3f& start,
                                              const Sighting& sighting) {
  Refined refined = model->refinement->refine(
      moved(start.inverse(), sighting),
      {Eigen::Isometry3f::Identity(), Points::Zero(3, model->sampled.size())});
  refined.pose = start * refined.pose;
  return refined;
}

/// A short search.
Refined Registrar::Implementation::refineFromEarlier(const Sighting& sighting,
                                                     const Eigen::Isometry3d& guess,
                                                     const Earlier& earlier) {
  const Deformation& found = *earlier.deformation;
  const Points moved = found.move(model->samples) - found.moveRigidly(model->samples);
  const Eigen::Matrix3f to_organ = found.rigidTransform().linear().transpose().cast<float>();
  return model->refinement->refine(
      sighting, {startOf(guess, &earlier), to_organ * moved / model->normalisation.scale, true});
}

RefinementQuality Registrar::Implementation::qualityOf(const Found& found,
                                                       const Deformation& deformation, bool cold) {
  const Refined& refined = *found.refined;
  const Agreement agreement = model->refinement->agreement(found.sighting, refined);
  RefinementQuality quality{refined.fit, surprise(refined), agreement.missing,
                            deformation.confidence(model->samples).mean(), agreement.residual_left};
  if (cold) quality.flip_gain = model->refinement->flipGain(found.sighting, refined.pose);
  return quality;
}

/// Where the search begins, from the guess and in the network's unit.
Eigen::Isometry3f Registrar::Implementation::startOf(const Eigen::Isometry3d& guess,
                                                     const Earlier* earlier) const {
  if (earlier == nullptr) return Eigen::Isometry3f::Identity();
  return model->toUnit(guess.inverse() * earlier->T_intraoperative_preoperative);
}

/// `turn`: the guess's rotation.
std::shared_ptr<const Deformation> Registrar::Implementation::deformationOf(
    const Found& found, const Eigen::Isometry3d& pose, const Eigen::Matrix3f& turn) {
  const Points& vertices = model->cloud.points;
  if (!found.refined) {
    return std::make_shared<const Deformation>(
        pose, vertices, turn * found.displacements * model->normalisation.scale);
  }
  const auto field = std::make_shared<const CoherentField>(
      model->refinement->prior(), model->normalisation, pose.linear().cast<float>(),
      found.refined->coefficients, found.refined->covariance_factor);
  return std::make_shared<const Deformation>(pose, vertices, field,
                                             field->valuesAt(model->functions, team));
}

Registrar::Registrar(std::shared_ptr<const Weights> weights, const RegistrationSettings& settings) {
  validate(settings);
  if (weights && weights->pairing == Pairing::kRow) {
    throw std::invalid_argument(
        "weights: their pairing is row, and the rows of two clouds of a patient have nothing in "
        "common; such weights serve only the benchmark");
  }
  implementation_ = std::make_unique<Implementation>(std::move(weights), settings);
}

Registrar::~Registrar() = default;

const RegistrationSettings& Registrar::settings() const { return implementation_->settings; }

void Registrar::setSettings(const RegistrationSettings& settings) {
  validate(settings);
  implementation_ = std::make_unique<Implementation>(implementation_->weights, settings);
}

Registration Registrar::registerClouds(const PointCloud& preoperative,
                                       const PointCloud& intraoperative,
                                       const Eigen::Isometry3d& guess, const Earlier* earlier) try {
  const PlausibilitySettings& limits = implementation_->settings.plausibility;
  const PointCloud organ = dropInvalid(preoperative);
  const PointCloud seen = dropInvalid(intraoperative);
  std::vector<PlausibilityCheck> checks;
  auto fault = findFault(organ, "the pre-operative cloud", limits, checks);
  if (!fault) fault = findFault(seen, "the intra-operative cloud", limits, checks);
  if (!fault) fault = findMismatch(organ, seen, limits, checks);
  if (fault) return ended(Status::kInvalidInput, *fault, std::move(checks));
  if (!guess.matrix().allFinite()) {
    return ended(Status::kInvalidInput, "the initial guess is not finite");
  }
  Registration registration = implementation_->run(organ, seen, guess, earlier);
  registration.checks.insert(registration.checks.begin(), checks.begin(), checks.end());
  return registration;
} catch (const std::exception& error) {
  return ended(Status::kFailed, std::string("internal error: ") + error.what());
}

Eigen::Isometry3d alignCentroids(const PointCloud& preoperative, const PointCloud& intraoperative) {
  const Eigen::Vector3f shift = centroid(intraoperative.points) - centroid(preoperative.points);
  return Eigen::Isometry3d(Eigen::Translation3d(shift.cast<double>()));
}

}  // namespace unirit
