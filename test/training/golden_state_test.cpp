// SPDX-License-Identifier: BSD-3-Clause
// Same weights, same clouds: LibTorch, which trains the network, and Eigen, which runs it, agree
// at every stage.
#include <gtest/gtest.h>

#include <filesystem>

#include "model.hpp"
#include "unirit/network/network.hpp"

namespace unirit {
namespace {

constexpr float kTolerance = 1e-4F;  // of the cloud's extent, which is 2 in the network's unit

/// Weights that turn and bend visibly: the scaled-down last layers of fresh ones are scaled up.
Weights strongWeights(Pairing pairing) {
  Weights weights = randomWeights(pairing, 7);
  if (pairing == Pairing::kOffsets) {
    weights.layers.at("flow.decoder.3").weight *= 2.5F;
    return weights;
  }
  weights.layers.at("rigid.decoder.5").weight *= 3.0F;
  weights.layers.at("nonrigid.decoder.5").weight *= 10.0F;
  return weights;
}

Points cloud(Eigen::Index count, unsigned seed) {
  std::srand(seed);
  return Points::Random(3, count);
}

torch::Tensor toTensor(const Points& points) {
  return torch::from_blob(const_cast<float*>(points.data()), {1, points.cols(), 3}).clone();
}

Points toPoints(const torch::Tensor& tensor) {
  const auto rows = tensor.detach().contiguous();
  return Eigen::Map<const Points>(rows.data_ptr<float>(), 3, rows.size(1));
}

class GoldenState : public testing::TestWithParam<Pairing> {
 protected:
  void SetUp() override {
    const torch::NoGradGuard no_grad;
    // Through a file, so that half precision is the same on both sides.
    const auto path = std::filesystem::temp_directory_path() / "unirit_golden_state.safetensors";
    writeWeights(strongWeights(GetParam()), path);
    weights_ = std::make_shared<const Weights>(readWeights(path));
    std::filesystem::remove(path);
    model_ = training::Unirit(GetParam());
    model_->setWeights(*weights_);
    network_ = makeNetwork(iterations_);
  }

  std::unique_ptr<Network> makeNetwork(int rigid_iterations) const {
    const NetworkSettings settings{rigid_iterations, GetParam()};
    return std::make_unique<Network>(weights_, settings, 2);
  }

  // By flow of several steps each, through which random weights multiply what rounding does
  const int iterations_ = GetParam() == Pairing::kOffsets ? 3 : 8;
  const Points source_ = cloud(700, 1);
  const Points target_ = cloud(GetParam() == Pairing::kRow ? 700 : 900, 2);
  std::shared_ptr<const Weights> weights_;
  training::Unirit model_ = nullptr;
  std::unique_ptr<Network> network_;
};

TEST_P(GoldenState, RigidStageAgreesForAnyNumberOfIterations) {
  const torch::NoGradGuard no_grad;
  const torch::Tensor target = toTensor(target_);
  torch::Tensor moved;
  for (int iterations = 1; iterations <= iterations_; ++iterations) {
    moved = model_->moveRigidly(toTensor(source_), target, iterations);
    const Points ours = makeNetwork(iterations)->estimateRigid(source_, target_) * source_;
    EXPECT_LT((ours - toPoints(moved)).cwiseAbs().maxCoeff(), kTolerance);
  }
  EXPECT_GT((toPoints(moved) - source_).cwiseAbs().maxCoeff(), 0.1F) << "a pose worth comparing";
}

TEST_P(GoldenState, NonRigidStageAgreesAtEveryPoint) {
  const torch::NoGradGuard no_grad;
  const Points ours = network_->estimateDisplacements(source_, target_, source_);
  const Points theirs = toPoints(model_->deform(toTensor(source_), toTensor(target_))) - source_;
  EXPECT_LT((ours - theirs).cwiseAbs().maxCoeff(), kTolerance);
  EXPECT_GT(theirs.cwiseAbs().maxCoeff(), 0.1F) << "a displacement worth comparing";
}

TEST_P(GoldenState, WholeNetworkAgrees) {
  const torch::NoGradGuard no_grad;
  const Points moved = network_->estimateRigid(source_, target_) * source_;
  const Points ours = moved + network_->estimateDisplacements(moved, target_, moved);
  const torch::Tensor target = toTensor(target_);
  const torch::Tensor source = model_->moveRigidly(toTensor(source_), target, iterations_);
  const auto theirs = model_->deform(source, target);
  EXPECT_LT((ours - toPoints(theirs)).cwiseAbs().maxCoeff(), 2.0F * kTolerance);
}

INSTANTIATE_TEST_SUITE_P(Pairings, GoldenState,
                         testing::Values(Pairing::kNearest, Pairing::kOffsets, Pairing::kNone,
                                         Pairing::kRow),
                         [](const auto& pairing) { return std::string(toString(pairing.param)); });

}  // namespace
}  // namespace unirit
