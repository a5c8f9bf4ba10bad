// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/registration.hpp"

#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

#include "unirit/plausibility.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

PointCloud dropInvalid(const PointCloud& cloud) {
  std::vector<Eigen::Index> valid;
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    if (cloud.points.col(i).allFinite()) valid.push_back(i);
  }
  if (static_cast<Eigen::Index>(valid.size()) == cloud.size()) return cloud;
  return {select(cloud.points, valid),
          cloud.normals.cols() == 0 ? Points() : select(cloud.normals, valid)};
}

/// Runs a stage and notes how long it took.
template <class Work>
void timed(const char* stage, std::vector<StageTime>& stages, Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - start;
  stages.push_back({stage, elapsed.count()});
}

Registration ended(Status status, std::string message) {
  Registration registration;
  registration.status = status;
  registration.message = std::move(message);
  return registration;
}

bool contains(const std::vector<Stage>& stages, Stage wanted) {
  for (const Stage stage : stages) {
    if (stage == wanted) return true;
  }
  return false;
}

}  // namespace

struct Registrar::Implementation {
  /// The organ, sampled and normalised: what does not change from one view to the next.
  struct Model {
    PointCloud cloud;  // as given
    Points sampled;    // 3 x N, the network's unit
    Points vertices;   // every point, the network's unit
    Normalisation normalisation;
    double extent = 0.0;  // [m]
  };

  Implementation(std::shared_ptr<const Weights> new_weights,
                 const RegistrationSettings& new_settings)
      : weights(std::move(new_weights)),
        settings(new_settings),
        network(weights, settings.network, settings.threads) {}

  void prepare(const PointCloud& preoperative) {
    if (model && model->cloud.points.cols() == preoperative.points.cols() &&
        model->cloud.points == preoperative.points) {
      return;
    }
    Model fresh;
    fresh.cloud = preoperative;
    fresh.extent = unirit::extent(preoperative.points);
    fresh.sampled =
        select(preoperative.points, sampleEvenly(preoperative.points, settings.sampling.points));
    fresh.normalisation = Normalisation::of(fresh.sampled);
    fresh.sampled = fresh.normalisation.apply(fresh.sampled);
    fresh.vertices = fresh.normalisation.apply(preoperative.points);
    model = std::make_unique<Model>(std::move(fresh));
  }

  Registration run(const PointCloud& preoperative, const PointCloud& intraoperative,
                   const Eigen::Isometry3d& guess);

  std::shared_ptr<const Weights> weights;
  RegistrationSettings settings;
  Network network;
  std::unique_ptr<Model> model;
};

/// The paper's figure: sample, normalise, move rigidly, displace, map back to metres.
Registration Registrar::Implementation::run(const PointCloud& preoperative,
                                            const PointCloud& intraoperative,
                                            const Eigen::Isometry3d& guess) {
  Registration registration = ended(Status::kSucceeded, "registered");
  auto& stages = registration.stages;

  // Bring the seen cloud to the organ's frame, sample both
  Points target;
  timed("sampling", stages, [&] {
    prepare(preoperative);
    const Points seen = (guess.inverse() * intraoperative.points.cast<double>()).cast<float>();
    target = select(seen, sampleEvenly(seen, settings.sampling.points));
    target = model->normalisation.apply(target);
  });

  // Rigid module
  Eigen::Isometry3f rigid = Eigen::Isometry3f::Identity();
  if (contains(settings.stages, Stage::kRigid)) {
    timed("rigid", stages, [&] { rigid = network.estimateRigid(model->sampled, target); });
  }

  // Non-rigid module, decoded at every point of the organ
  Points displacements = Points::Zero(3, preoperative.size());
  if (contains(settings.stages, Stage::kNonRigid)) {
    timed("nonrigid", stages, [&] {
      displacements =
          network.estimateDisplacements(rigid * model->sampled, target, rigid * model->vertices);
    });
  }

  // Back to metres and to the seen cloud's frame
  timed("assessment", stages, [&] {
    const auto scale = static_cast<double>(model->normalisation.scale);
    const Eigen::Vector3d offset = model->normalisation.offset.cast<double>();
    Eigen::Isometry3d moved = rigid.cast<double>();
    moved.linear() = Eigen::Quaterniond(moved.linear()).normalized().toRotationMatrix();
    moved.translation() = scale * moved.translation() + offset - moved.linear() * offset;
    registration.T_intraoperative_preoperative = guess * moved;
    displacements = guess.linear().cast<float>() * displacements * model->normalisation.scale;
    registration.deformation = std::make_shared<const Deformation>(
        registration.T_intraoperative_preoperative, preoperative.points, displacements);
    registration.residual =
        surfaceResidual(registration.deformation->movedSurface(), intraoperative.points,
                        settings.plausibility.inlier_tolerance);
    registration.displacement = displacementStatistics(
        registration.deformation->moveRigidly(preoperative.points), displacements);
  });
  applyChecks(checkOutput(registration, model->extent, settings.plausibility), registration);
  return registration;
}

Registrar::Registrar(std::shared_ptr<const Weights> weights, const RegistrationSettings& settings) {
  validate(settings);
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
                                       const Eigen::Isometry3d& guess) try {
  const PlausibilitySettings& limits = implementation_->settings.plausibility;
  const PointCloud organ = dropInvalid(preoperative);
  const PointCloud seen = dropInvalid(intraoperative);
  if (auto fault = findFault(organ, "the pre-operative cloud", limits)) {
    return ended(Status::kInvalidInput, *fault);
  }
  if (auto fault = findFault(seen, "the intra-operative cloud", limits)) {
    return ended(Status::kInvalidInput, *fault);
  }
  if (auto fault = findMismatch(organ, seen, limits)) {
    return ended(Status::kInvalidInput, *fault);
  }
  if (!guess.matrix().allFinite()) {
    return ended(Status::kInvalidInput, "the initial guess is not finite");
  }
  return implementation_->run(organ, seen, guess);
} catch (const std::exception& error) {
  return ended(Status::kFailed, std::string("internal error: ") + error.what());
}

Eigen::Isometry3d alignCentroids(const PointCloud& preoperative, const PointCloud& intraoperative) {
  const Eigen::Vector3f shift = centroid(intraoperative.points) - centroid(preoperative.points);
  return Eigen::Isometry3d(Eigen::Translation3d(shift.cast<double>()));
}

}  // namespace unirit
