// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/registration.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <stdexcept>
#include <utility>

#include "refinement/coherent_field.hpp"
#include "refinement/refinement.hpp"
#include "unirit/normals.hpp"
#include "unirit/plausibility.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

// Of Refined::fit, found on training organs with 1024 points
constexpr double kPoorFit = -5.4;
constexpr double kClearlyBetterWhole = 0.2;
constexpr double kClearlyBetterView = 0.5;  // any pose of a part of the organ fits almost as well

PointCloud dropInvalid(const PointCloud& cloud) {
  if (cloud.points.allFinite()) return cloud;
  std::vector<Eigen::Index> valid;
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    if (cloud.points.col(i).allFinite()) valid.push_back(i);
  }
  return {select(cloud.points, valid),
          cloud.normals.cols() == 0 ? Points() : select(cloud.normals, valid), cloud.viewpoint};
}

/// The cloud's own normals, or estimated ones turned outwards.
Points normalsOf(const PointCloud& cloud, const std::vector<Eigen::Index>& samples) {
  if (cloud.normals.cols() > 0) return select(cloud.normals, samples);
  return outwardNormals(select(cloud.points, samples));
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

bool contains(const std::vector<Stage>& stages, Stage wanted) {
  for (const Stage stage : stages) {
    if (stage == wanted) return true;
  }
  return false;
}

/// Of the prior's variance of 1 a coefficient, what is not left after the cloud was seen.
double surprise(const Refined& refined) {
  const auto prior = static_cast<double>(refined.coefficients.size());
  const double learnt = prior - static_cast<double>(refined.covariance_factor.squaredNorm());
  return refined.coefficients.norm() / std::sqrt(std::max(learnt, 1.0));
}

void keepBetter(const Refined& other, bool whole, Refined& refined) {
  const double margin = whole ? kClearlyBetterWhole : kClearlyBetterView;
  if (other.fit > refined.fit + margin) refined = other;
}

}  // namespace

struct Registrar::Implementation {
  /// The organ, sampled and normalised: what does not change from one view to the next.
  struct Model {
    PointCloud cloud;    // as given
    Points samples;      // N points of it
    PointCloud sampled;  // the same with normals, the network's unit
    Points vertices;     // every point, the network's unit
    Normalisation normalisation;
    double extent = 0.0;  // [m]
    std::unique_ptr<Refinement> refinement;
    Eigen::MatrixXf functions;  // the refinement's prior's, at every point
  };

  Implementation(std::shared_ptr<const Weights> new_weights,
                 const RegistrationSettings& new_settings)
      : weights(std::move(new_weights)),
        settings(new_settings),
        network(weights, settings.network, settings.threads),
        team(settings.threads) {}

  void prepare(const PointCloud& preoperative) {
    if (model && model->cloud.points.cols() == preoperative.points.cols() &&
        model->cloud.points == preoperative.points &&
        model->cloud.normals.cols() == preoperative.normals.cols() &&
        model->cloud.normals == preoperative.normals) {
      return;
    }
    auto fresh = std::make_unique<Model>();
    fresh->cloud = preoperative;
    fresh->extent = unirit::extent(preoperative.points);
    const auto samples = sampleEvenly(preoperative.points, settings.sampling.points);
    fresh->samples = select(preoperative.points, samples);
    fresh->normalisation = Normalisation::of(fresh->samples);
    fresh->sampled = {fresh->normalisation.apply(fresh->samples), normalsOf(preoperative, samples)};
    fresh->vertices = fresh->normalisation.apply(preoperative.points);
    if (contains(settings.stages, Stage::kRefine)) {
      fresh->refinement =
          std::make_unique<Refinement>(fresh->sampled, settings.refinement, selectKernels(), team);
      fresh->functions = fresh->refinement->prior()->functions(fresh->vertices, team);
    }
    model = std::move(fresh);
  }

  Registration run(const PointCloud& preoperative, const PointCloud& intraoperative,
                   const Eigen::Isometry3d& guess, const Earlier* earlier);

  PointCloud sample(const PointCloud& cloud, const Eigen::Isometry3d& T_organ_cloud) const;
  Refined refineFrom(const Eigen::Isometry3f& start, const Sighting& sighting,
                     const Points& displacements);
  Refined refineFromStart(const Sighting& sighting, const Eigen::Isometry3d& guess,
                          const Earlier* earlier);
  RefinementQuality qualityOf(const Refined& refined, const Sighting& sighting,
                              const Deformation& deformation, bool cold) const;
  Eigen::Isometry3d toMetres(const Eigen::Isometry3f& pose) const;
  Eigen::Isometry3f startOf(const Eigen::Isometry3d& guess, const Earlier& earlier) const;
  std::shared_ptr<const Deformation> deformationOf(const PointCloud& preoperative,
                                                   const Eigen::Isometry3d& pose,
                                                   const Points& displacements,
                                                   const Eigen::Matrix3f& turn,
                                                   const std::optional<Refined>& refined);

  std::shared_ptr<const Weights> weights;
  RegistrationSettings settings;
  Network network;
  ThreadTeam team;  // the refinement's
  std::unique_ptr<Model> model;
};

/// The paper's figure: sample, normalise, move rigidly, displace, map back to metres. Where the
/// refinement fits well from the start, the network's modules are passed over.
Registration Registrar::Implementation::run(const PointCloud& preoperative,
                                            const PointCloud& intraoperative,
                                            const Eigen::Isometry3d& guess,
                                            const Earlier* earlier) {
  Registration registration = ended(Status::kSucceeded, "registered");
  auto& stages = registration.stages;

  // Bring the seen cloud to the organ's frame, sample both
  PointCloud target;
  timed("sampling", stages, [&] {
    prepare(preoperative);
    target = sample(intraoperative, guess.inverse());
  });

  // Refinement from the start
  std::optional<Refined> refined;
  Sighting sighting;
  const bool refines = contains(settings.stages, Stage::kRefine);
  if (refines) {
    timed("refine", stages, [&] {
      sighting = model->refinement->sight(target);
      refined = refineFromStart(sighting, guess, earlier);
    });
  }
  const bool fits = refined && refined->fit > kPoorFit;

  // Rigid module
  Eigen::Isometry3f rigid = Eigen::Isometry3f::Identity();
  if (contains(settings.stages, Stage::kRigid) && !fits) {
    timed("rigid", stages,
          [&] { rigid = network.estimateRigid(model->sampled.points, target.points); });
  }

  // Non-rigid module, decoded at every point of the organ or where the refinement starts from
  const Points& queries = refines ? model->sampled.points : model->vertices;
  Points displacements = Points::Zero(3, queries.cols());
  if (contains(settings.stages, Stage::kNonRigid) && !fits) {
    timed("nonrigid", stages, [&] {
      displacements = network.estimateDisplacements(rigid * model->sampled.points, target.points,
                                                    rigid * queries);
    });
  }

  // Refinement from where the network left the organ
  if (refined && !fits && settings.stages.front() != Stage::kRefine) {
    timed("refine", stages, [&] {
      keepBetter(refineFrom(rigid, sighting, displacements), sighting.whole, *refined);
    });
  }
  if (refined) rigid = refined->pose;

  timed("assessment", stages, [&] {
    registration.T_intraoperative_preoperative = guess * toMetres(rigid);
    registration.next_guess = guess * toMetres(beyondExpectation(rigid));
    registration.deformation =
        deformationOf(preoperative, registration.T_intraoperative_preoperative, displacements,
                      guess.linear().cast<float>(), refined);
    registration.residual =
        surfaceResidual(registration.deformation->movedSurface(), intraoperative.points,
                        settings.plausibility.inlier_tolerance);
    registration.displacement =
        displacementStatistics(registration.deformation->displacements(),
                               registration.deformation->jacobians(model->samples));
    if (refined && settings.refinement.correspondence == Correspondence::kSurface) {
      registration.refinement =
          qualityOf(*refined, sighting, *registration.deformation, earlier == nullptr);
    }
    const Eigen::Isometry3d start =
        earlier == nullptr ? guess : earlier->T_intraoperative_preoperative;
    const Eigen::Isometry3f predicted =
        earlier == nullptr ? Eigen::Isometry3f::Identity() : startOf(guess, *earlier);
    applyChecks({checkOverlap(predicted * model->sampled.points, target.points,
                              model->extent / model->normalisation.scale, settings.plausibility)},
                registration);
    applyChecks(checkOutput(registration, start, model->extent, settings.plausibility),
                registration);
  });
  return registration;
}

/// The seen cloud in the network's unit and, where its viewpoint is known, that too.
PointCloud Registrar::Implementation::sample(const PointCloud& cloud,
                                             const Eigen::Isometry3d& T_organ_cloud) const {
  const auto toNetwork = [&](const Points& points) {
    return model->normalisation.apply(moved(T_organ_cloud, points));
  };
  PointCloud sampled{
      toNetwork(select(cloud.points, sampleEvenly(cloud.points, settings.sampling.points))), {}};
  if (cloud.viewpoint) sampled.viewpoint = toNetwork(*cloud.viewpoint);
  return sampled;
}

/// The refinement from a pose, and about it; displacements of the samples after it.
Refined Registrar::Implementation::refineFrom(const Eigen::Isometry3f& start,
                                              const Sighting& sighting,
                                              const Points& displacements) {
  const Eigen::Isometry3f to_start = start.inverse();
  Refined refined =
      model->refinement->refine(moved(to_start, sighting),
                                {Eigen::Isometry3f::Identity(), to_start.linear() * displacements});
  refined.pose = start * refined.pose;
  return refined;
}

/// A short search from what was found earlier, if anything was; a whole one from the guess where
/// nothing was or it fits poorly.
Refined Registrar::Implementation::refineFromStart(const Sighting& sighting,
                                                   const Eigen::Isometry3d& guess,
                                                   const Earlier* earlier) {
  const auto afar = [&] {
    return model->refinement->refine(
        sighting, {Eigen::Isometry3f::Identity(), Points::Zero(3, model->sampled.size())});
  };
  if (earlier == nullptr) return afar();
  const Deformation& found = *earlier->deformation;
  const Points moved = found.move(model->samples) - found.moveRigidly(model->samples);
  const Eigen::Matrix3f to_organ = found.rigidTransform().linear().transpose().cast<float>();
  Refined refined = model->refinement->refine(
      sighting, {startOf(guess, *earlier), to_organ * moved / model->normalisation.scale, true});
  if (refined.fit < kPoorFit) keepBetter(afar(), sighting.whole, refined);
  return refined;
}

RefinementQuality Registrar::Implementation::qualityOf(const Refined& refined,
                                                       const Sighting& sighting,
                                                       const Deformation& deformation,
                                                       bool cold) const {
  const Agreement agreement = model->refinement->agreement(sighting, refined);
  RefinementQuality quality{refined.fit, surprise(refined), agreement.missing,
                            deformation.confidence(model->samples).mean(), agreement.residual_left};
  if (cold) quality.flip_gain = model->refinement->flipGain(sighting, refined.pose);
  return quality;
}

Eigen::Isometry3d Registrar::Implementation::toMetres(const Eigen::Isometry3f& pose) const {
  const auto scale = static_cast<double>(model->normalisation.scale);
  const Eigen::Vector3d offset = model->normalisation.offset.cast<double>();
  Eigen::Isometry3d moved = pose.cast<double>();
  moved.linear() = Eigen::Quaterniond(moved.linear()).normalized().toRotationMatrix();
  moved.translation() = scale * moved.translation() + offset - moved.linear() * offset;
  return moved;
}

/// The earlier pose from the guess, in the network's unit.
Eigen::Isometry3f Registrar::Implementation::startOf(const Eigen::Isometry3d& guess,
                                                     const Earlier& earlier) const {
  const Eigen::Vector3d offset = model->normalisation.offset.cast<double>();
  Eigen::Isometry3d pose = guess.inverse() * earlier.T_intraoperative_preoperative;
  pose.translation() = (pose * offset - offset) / static_cast<double>(model->normalisation.scale);
  return pose.cast<float>();
}

/// `displacements`: of every point of the organ, in the network's unit, where nothing was refined.
std::shared_ptr<const Deformation> Registrar::Implementation::deformationOf(
    const PointCloud& preoperative, const Eigen::Isometry3d& pose, const Points& displacements,
    const Eigen::Matrix3f& turn, const std::optional<Refined>& refined) {
  if (refined) {
    const auto field = std::make_shared<const CoherentField>(
        model->refinement->prior(), model->normalisation, pose.linear().cast<float>(),
        refined->coefficients, refined->covariance_factor);
    return std::make_shared<const Deformation>(pose, preoperative.points, field,
                                               field->valuesAt(model->functions, team));
  }
  return std::make_shared<const Deformation>(pose, preoperative.points,
                                             turn * displacements * model->normalisation.scale);
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
