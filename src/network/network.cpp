// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/network/network.hpp"

#include <stdexcept>
#include <string>

#include "encoder.hpp"
#include "nonrigid_decoder.hpp"
#include "rigid_decoder.hpp"

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
        pairing(settings.pairing),
        rigid_iterations(settings.rigid_iterations),
        workspace(selectKernels(), threads) {}

  /// To the nearest of `others`; null where the encoders do not read them.
  const NearestOffsets* offsetsTo(const Points& others, NearestOffsets& offsets) const {
    if (pairing != Pairing::kOffsets) return nullptr;
    offsets.setOthers(others);
    return &offsets;
  }

  std::shared_ptr<const Weights> weights;
  Pairing pairing;
  int rigid_iterations;
  Workspace workspace;
  Encoder rigid_source{workspace.kernels(), *weights, "rigid.source_encoder"};
  Encoder rigid_target{workspace.kernels(), *weights, "rigid.target_encoder"};
  RigidDecoder rigid_decoder{workspace.kernels(), *weights};
  Encoder nonrigid_source{workspace.kernels(), *weights, "nonrigid.source_encoder"};
  Encoder nonrigid_target{workspace.kernels(), *weights, "nonrigid.target_encoder"};
  NonRigidDecoder nonrigid_decoder{workspace.kernels(), *weights};
  Eigen::VectorXf rigid_features = Eigen::VectorXf::Zero(2 * kFeatureSize);
  Eigen::VectorXf nonrigid_features = Eigen::VectorXf::Zero(2 * kFeatureSize);
  NearestOffsets to_source;
  NearestOffsets to_target;
  Points moved;
};

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
  requireCloud(source, "source");
  requireCloud(target, "target");
  auto& network = *implementation_;
  float* features = network.rigid_features.data();

  const NearestOffsets* to_target = network.offsetsTo(target, network.to_target);
  network.moved = source;
  Eigen::Quaternionf rotation = Eigen::Quaternionf::Identity();
  Eigen::Isometry3f transform = Eigen::Isometry3f::Identity();
  for (int i = 0; i < network.rigid_iterations; ++i) {
    const NearestOffsets* to_source = network.offsetsTo(network.moved, network.to_source);
    network.rigid_source.encode(network.moved, to_target, features, network.workspace);
    // Unless it reads the way to the source, the target's feature stands still
    if (i == 0 || to_source != nullptr) {
      network.rigid_target.encode(target, to_source, features + kFeatureSize, network.workspace);
    }
    const RigidStep step = network.rigid_decoder.decode(features, network.workspace);

    // Apply the step
    const Eigen::Matrix3f step_rotation = step.rotation.toRotationMatrix();
    for (Eigen::Index column = 0; column < network.moved.cols(); ++column) {
      network.moved.col(column) =
          (step_rotation * network.moved.col(column) + step.translation).eval();
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
  if (network.pairing == Pairing::kRow &&
      (queries.cols() != source.cols() || queries != source || source.cols() != target.cols())) {
    throw std::invalid_argument(
        "queries: with pairing row they must be the source's points, as many as the target's");
  }
  float* features = network.nonrigid_features.data();
  const NearestOffsets* to_target = network.offsetsTo(target, network.to_target);
  const NearestOffsets* to_source = network.offsetsTo(source, network.to_source);
  network.nonrigid_source.encode(source, to_target, features, network.workspace);
  network.nonrigid_target.encode(target, to_source, features + kFeatureSize, network.workspace);
  if (network.pairing == Pairing::kNearest) {  // the decoder alone reads them
    network.to_target.setOthers(target);
    to_target = &network.to_target;
  }
  network.nonrigid_decoder.decode(features, target, to_target, queries, displacements,
                                  network.workspace);
}

const Eigen::VectorXf& Network::rigidFeatures() const { return implementation_->rigid_features; }

const Eigen::VectorXf& Network::nonRigidFeatures() const {
  return implementation_->nonrigid_features;
}

const Weights& Network::weights() const { return *implementation_->weights; }

}  // namespace unirit
