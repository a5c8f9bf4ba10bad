// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/network/network.hpp"

#include <optional>
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

/// Encoders, decoder and their features.
struct RigidModule {
  RigidModule(const Kernels& kernels, const Weights& weights, const std::string& name, int layers)
      : source(kernels, weights, name + ".source_encoder"),
        target(kernels, weights, name + ".target_encoder"),
        decoder(kernels, weights, name + ".decoder", layers),
        features(Eigen::VectorXf::Zero(source.featureSize() + target.featureSize())) {}

  Encoder source, target;
  RigidDecoder decoder;
  Eigen::VectorXf features;
};

}  // namespace

struct Network::Implementation {
  Implementation(std::shared_ptr<const Weights> shared_weights, const NetworkSettings& settings,
                 int threads)
      : weights(std::move(shared_weights)),
        pairing(settings.pairing),
        rigid_iterations(settings.rigid_iterations),
        workspace(selectKernels(), threads) {
    if (pairing != Pairing::kOffsets) return;
    fine.emplace(workspace.kernels(), *weights, "fine",
                 static_cast<int>(kFineDecoderWidths.size()));
  }

  RigidStep coarseStep(const Points& target, bool first);
  RigidStep fineStep(const Points& target);

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
  RigidModule rigid{workspace.kernels(), *weights, "rigid",
                    static_cast<int>(kRigidDecoderWidths.size())};
  std::optional<RigidModule> fine;  // with pairing offsets
  Encoder nonrigid_source{workspace.kernels(), *weights, "nonrigid.source_encoder"};
  Encoder nonrigid_target{workspace.kernels(), *weights, "nonrigid.target_encoder"};
  NonRigidDecoder nonrigid_decoder{workspace.kernels(), *weights};
  Eigen::VectorXf nonrigid_features = Eigen::VectorXf::Zero(2 * kFeatureSize);
  NearestOffsets to_source;
  NearestOffsets to_target;
  Points moved;
};

/// From where `moved` stands. The target's feature stands still.
RigidStep Network::Implementation::coarseStep(const Points& target, bool first) {
  float* features = rigid.features.data();
  rigid.source.encode(moved, nullptr, features, workspace);
  if (first) rigid.target.encode(target, nullptr, features + kFeatureSize, workspace);
  return rigid.decoder.decode(features, workspace);
}

/// The same of the fine module, for which to_target is set; the target's points read the way to
/// where the source has come.
RigidStep Network::Implementation::fineStep(const Points& target) {
  float* features = fine->features.data();
  to_source.setOthers(moved);
  fine->source.encode(moved, &to_target, features, workspace);
  fine->target.encode(target, &to_source, features + fine->source.featureSize(), workspace);
  return fine->decoder.decode(features, workspace);
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
  requireCloud(source, "source");
  requireCloud(target, "target");
  auto& network = *implementation_;
  const int coarse = coarseIterations(network.pairing, network.rigid_iterations);
  if (coarse < network.rigid_iterations) network.to_target.setOthers(target);
  network.moved = source;
  Eigen::Quaternionf rotation = Eigen::Quaternionf::Identity();
  Eigen::Isometry3f transform = Eigen::Isometry3f::Identity();
  for (int i = 0; i < network.rigid_iterations; ++i) {
    const RigidStep step =
        i < coarse ? network.coarseStep(target, i == 0) : network.fineStep(target);

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

const Eigen::VectorXf& Network::rigidFeatures() const { return implementation_->rigid.features; }

const Eigen::VectorXf& Network::nonRigidFeatures() const {
  return implementation_->nonrigid_features;
}

const Weights& Network::weights() const { return *implementation_->weights; }

}  // namespace unirit
