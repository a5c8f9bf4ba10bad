// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "instruction_set_test.hpp"
#include "network_inputs.hpp"
#include "network_reference.hpp"

namespace unirit {
namespace {

using test::loudWeights;
using test::randomPoints;
using test::surfacePoints;

constexpr double kTolerance = 1e-4;         // of the cloud's half extent
constexpr double kSavingsTolerance = 1e-5;  // what leaving out repeated products may change

class NetworkForward : public InstructionSetTest {
 protected:
  static void expectRigidAgrees(Pairing pairing, const Points& source, const Points& target,
                                int iterations) {
    const auto weights = loudWeights(pairing);
    const NetworkSettings settings{iterations, pairing};
    Network network(weights, settings, 2);
    std::vector<Eigen::Isometry3f> iterates;
    const Eigen::Isometry3f transform = network.estimateRigid(source, target, &iterates);

    const auto expected = reference::estimateRigid(*weights, source, target, iterations);
    ASSERT_EQ(iterates.size(), expected.size());
    EXPECT_TRUE(transform.isApprox(iterates.back(), 0.0F));
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_LT((iterates[i].matrix().cast<double>() - expected[i].matrix()).cwiseAbs().maxCoeff(),
                kTolerance)
          << "iteration " << i;
      // The target must count, and so must each iteration, or agreement would say little.
      EXPECT_GT((expected[i].matrix() - Eigen::Matrix4d::Identity()).norm(), 0.01);
    }
  }

  static void expectDisplacementsAgree(Pairing pairing, const Points& source, const Points& target,
                                       const Points& queries) {
    const auto weights = loudWeights(pairing);
    NetworkSettings settings;
    settings.pairing = pairing;
    Network network(weights, settings, 2);
    const Points displacements = network.estimateDisplacements(source, target, queries);

    const auto expected = reference::estimateDisplacements(*weights, source, target, queries);
    ASSERT_EQ(displacements.cols(), queries.cols());
    EXPECT_LT((displacements.cast<double>() - expected).cwiseAbs().maxCoeff(), kSavingsTolerance);
    EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.1);
  }
};

TEST_P(NetworkForward, runsTheInstructionSetAskedFor) {
  EXPECT_EQ(selectKernels().instruction_set, GetParam());
}

TEST_P(NetworkForward, featuresAgreeWithTheReference) {
  const Points source = randomPoints(203, 1);
  const Points target = randomPoints(131, 2);
  const auto weights = loudWeights(Pairing::kNearest);
  Network network(weights, {1, Pairing::kNearest}, 2);
  network.estimateRigid(source, target);
  network.estimateDisplacements(source, target, source);

  const Points& a = source;
  const Points& b = target;
  const auto expectNear = [&](const Eigen::VectorXf& features, const std::string& module) {
    const Eigen::VectorXd expected =
        reference::features(*weights, module, a.cast<double>(), b.cast<double>());
    EXPECT_LT((features.cast<double>() - expected).cwiseAbs().maxCoeff(), kTolerance) << module;
  };
  expectNear(network.rigidFeatures(), "rigid");
  expectNear(network.nonRigidFeatures(), "nonrigid");
}

TEST_P(NetworkForward, everyRigidIterateAgreesWithTheReference) {
  expectRigidAgrees(Pairing::kNearest, surfacePoints(203, 1), surfacePoints(131, 2), 8);
  // of three steps and of six, through which random weights multiply what rounding does
  expectRigidAgrees(Pairing::kOffsets, surfacePoints(203, 1), surfacePoints(131, 2), 2);
}

TEST_P(NetworkForward, coarseIterationsReadSomePointsOfLargeClouds) {
  expectRigidAgrees(Pairing::kOffsets, surfacePoints(500, 1), surfacePoints(400, 2), 2);
}

TEST_P(NetworkForward, cloudsOfOnePointAreRegistered) {
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    const int iterations = pairing == Pairing::kOffsets ? 2 : 4;
    expectRigidAgrees(pairing, surfacePoints(1, 1), surfacePoints(131, 2), iterations);
    expectRigidAgrees(pairing, surfacePoints(131, 1), surfacePoints(1, 2), iterations);
    expectDisplacementsAgree(pairing, surfacePoints(1, 1), surfacePoints(1, 2),
                             surfacePoints(1, 3));
  }
}

TEST_P(NetworkForward, displacementsAgreeWithTheReferenceThatSavesNothing) {
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets, Pairing::kNone}) {
    expectDisplacementsAgree(pairing, surfacePoints(203, 1), surfacePoints(131, 2),
                             surfacePoints(317, 3));
  }
  const Points source = surfacePoints(203, 1);
  expectDisplacementsAgree(Pairing::kRow, source, surfacePoints(203, 2), source);
  expectDisplacementsAgree(Pairing::kOffsets, source, surfacePoints(131, 2), source);
}

TEST_P(NetworkForward, noQueriesGiveNoDisplacements) {
  Network network(loudWeights(NetworkSettings().pairing), {}, 2);
  const Points cloud = surfacePoints(9, 1);
  EXPECT_EQ(network.estimateDisplacements(cloud, cloud, Points(3, 0)).cols(), 0);
}

UNIRIT_ON_EVERY_INSTRUCTION_SET(NetworkForward);

}  // namespace
}  // namespace unirit
