// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/network/network.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "modules.hpp"

namespace unirit {
namespace {

void requireCloud(const Points& points, const std::string& name) {
  if (points.cols() == 0) {
    throw std::invalid_argument(name + ": the cloud has no points");
  }
  if (!points.allFinite()) {
    throw std::invalid_argument(name + ": the cloud has a coordinate that is not finite");
  }
}

void requireFit(const std::shared_ptr<const Weights>& weights, const NetworkSettings& settings) {
  if (!weights) {
    throw std::invalid_argument("weights: none were given");
  }
  if (settings.pairing != weights->pairing) {
    throw std::invalid_argument(std::string("settings.pairing: ") + toString(settings.pairing) +
                                " does not fit the weights, which were trained with " +
                                toString(weights->pairing));
  }
  if (settings.rigid_iterations < 1) {
    throw std::invalid_argument("settings.rigid_iterations: must be at least 1");
  }
  validate(*weights);
}

}  // namespace

struct Network::Implementation {
  Implementation(std::shared_ptr<const Weights> shared_weights, const NetworkSettings& settings,
                 int threads)
      : weights(std::move(shared_weights)),
        rigid_iterations(settings.rigid_iterations),
        workspace(selectKernels(), threads),
        modules(weights->pairing == Pairing::kOffsets ? makeFlowModule(*weights, workspace)
                                                      : makePublishedModules(*weights, workspace)) {
  }

  Eigen::Isometry3f iterate(const Points& source, const Points& target, bool finely,
                            std::vector<Eigen::Isometry3f>* iterates);

  std::shared_ptr<const Weights> weights;
  int rigid_iterations;
  Workspace workspace;
  std::unique_ptr<Modules> modules;
  Points moved;
};

/// Ends with a last iteration that is fine, or with the last coarse one.
Eigen::Isometry3f Network::Implementation::iterate(const Points& source, const Points& target,
                                                   bool finely,
                                                   std::vector<Eigen::Isometry3f>* iterates) {
  requireCloud(source, "source");
  requireCloud(target, "target");
  moved = source;
  Eigen::Quaternionf rotation = Eigen::Quaternionf::Identity();
  Eigen::Isometry3f transform = Eigen::Isometry3f::Identity();
  const int after_converged = finely ? 1 : 0;
  bool first = true;
  for (int left = rigid_iterations; left > 0; first = false) {
    const RigidStep step = modules->rigidStep(moved, target, first, finely && left == 1);
    left = step.converged ? std::min(left - 1, after_converged) : left - 1;

    // Apply the step
    const Eigen::Matrix3f step_rotation = step.rotation.toRotationMatrix();
    for (Eigen::Index column = 0; column < moved.cols(); ++column) {
      moved.col(column) = (step_rotation * moved.col(column) + step.translation).eval();
    }

    // Compose, and keep the rotation a rotation
    rotation = (step.rotation * rotation).normalized();
    transform.translation() = step_rotation * transform.translation() + step.translation;
    transform.linear() = rotation.toRotationMatrix();
    if (iterates != nullptr) {
      iterates->push_back(transform);
    }
  }
  return transform;
}

Network::Network(std::shared_ptr<const Weights> weights, const NetworkSettings& settings,
                 int threads) {
  requireFit(weights, settings);
  implementation_ = std::make_unique<Implementation>(std::move(weights), settings, threads);
}

Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

Eigen::Isometry3f Network::estimateRigid(const Points& source, const Points& target,
                                         std::vector<Eigen::Isometry3f>* iterates) {
  return implementation_->iterate(source, target, true, iterates);
}

Eigen::Isometry3f Network::estimateRigidCoarsely(const Points& source, const Points& target) {
  return implementation_->iterate(source, target, false, nullptr);
}

Points Network::estimateDisplacements(const Points& source, const Points& target,
                                      const Points& queries) {
  Points displacements;
  estimateDisplacements(source, target, queries, displacements);
  return displacements;
}

void Network::estimateDisplacements(const Points& source, const Points& target,
                                    const Points& queries, Points& displacements) {
  requireCloud(source, "source");
  requireCloud(target, "target");
  if (!queries.allFinite()) {
    throw std::invalid_argument("queries: a coordinate is not finite");
  }
  auto& network = *implementation_;
  if (network.weights->pairing == Pairing::kRow &&
      (queries.cols() != source.cols() || queries != source || source.cols() != target.cols())) {
    throw std::invalid_argument(
        "queries: with pairing row they must be the source's points, as many as the target's");
  }
  displacements.resize(3, queries.cols());
  network.modules->displace(source, target, queries, displacements);
}

const Eigen::VectorXf& Network::rigidFeatures() const {
  return implementation_->modules->rigidFeatures();
}

const Eigen::VectorXf& Network::nonRigidFeatures() const {
  return implementation_->modules->nonRigidFeatures();
}

const Weights& Network::weights() const { return *implementation_->weights; }

}  // namespace unirit
