// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "instruction_set_test.hpp"
#include "network_inputs.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

using test::loudWeights;
using test::randomPoints;
using test::shuffled;

/// Everything a forward pass puts out.
struct Output {
  Eigen::Matrix4f transform;
  Points displacements;
};

class NetworkDeterminism : public InstructionSetTest {
 protected:
  Output run(const Points& source, const Points& target, const Points& queries, int threads = 2) {
    NetworkSettings settings;
    settings.pairing = pairing_;
    settings.rigid_iterations = 3;  // of the flow two coarse ones and a fine one
    Network network(loudWeights(pairing_), settings, threads);
    return {network.estimateRigid(source, target).matrix(),
            network.estimateDisplacements(source, target, queries)};
  }

  Pairing pairing_ = Pairing::kNearest;
  Points source_ = randomPoints(203, 1);
  Points target_ = randomPoints(131, 2);
  Points queries_ = randomPoints(317, 3);
};

TEST_P(NetworkDeterminism, anyNumberOfThreadsGivesTheSameBits) {
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    pairing_ = pairing;
    const Output one = run(source_, target_, queries_, 1);
    for (const int threads : {2, 3}) {
      const Output other = run(source_, target_, queries_, threads);
      EXPECT_EQ(other.transform, one.transform) << threads << " threads";
      EXPECT_EQ(other.displacements, one.displacements) << threads << " threads";
    }
  }
}

TEST_P(NetworkDeterminism, theOrderOfTheCloudsChangesNoBit) {
  const auto query_order = shuffled(queries_.cols(), 6);
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets, Pairing::kNone}) {
    pairing_ = pairing;
    const Output straight = run(source_, target_, queries_);
    const Output shuffled_output =
        run(select(source_, shuffled(source_.cols(), 4)),
            select(target_, shuffled(target_.cols(), 5)), select(queries_, query_order));
    EXPECT_EQ(shuffled_output.transform, straight.transform);
    EXPECT_EQ(shuffled_output.displacements, select(straight.displacements, query_order));
  }
}

TEST_P(NetworkDeterminism, withPairingRowTheOrderOfTheTargetDecides) {
  pairing_ = Pairing::kRow;
  const Points target = randomPoints(source_.cols(), 2);
  const auto order = shuffled(source_.cols(), 4);
  const Output straight = run(source_, target, source_);
  const Points moved = select(source_, order);
  EXPECT_EQ(run(moved, select(target, order), moved).displacements,
            select(straight.displacements, order));
  EXPECT_NE(run(source_, select(target, order), source_).displacements, straight.displacements);
}

TEST_P(NetworkDeterminism, aTieOfNearestTargetsDoesNotDependOnTheirOrder) {
  Points target(3, 4);
  target << 1, -1, 0, 0,  //
      0, 0, 1, -1,        //
      0, 0, 0, 0;
  const Points centre = Points::Zero(3, 1);
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    pairing_ = pairing;
    const Points reversed = target.rowwise().reverse();
    for (const Points& source : {source_, centre}) {
      const Output straight = run(source, target, centre);
      const Output turned_round = run(source, reversed, centre);
      EXPECT_EQ(turned_round.transform, straight.transform);
      EXPECT_EQ(turned_round.displacements, straight.displacements);
    }
    EXPECT_EQ(run(reversed, centre, centre).transform, run(target, centre, centre).transform);
  }
}

TEST_P(NetworkDeterminism, aPointsDisplacementDoesNotDependOnTheOtherQueries) {
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    pairing_ = pairing;
    const Output together = run(source_, target_, queries_);
    for (const Eigen::Index i : {0, 47, 48, 311, 316}) {
      EXPECT_EQ(run(source_, target_, queries_.col(i)).displacements,
                together.displacements.col(i));
    }
    const Output of_source = run(source_, target_, source_);
    EXPECT_EQ(run(source_, target_, source_.col(7)).displacements, of_source.displacements.col(7));
  }
}

TEST_P(NetworkDeterminism, theOrderOfLargeCloudsChangesNoBit) {
  pairing_ = Pairing::kOffsets;
  const Points source = randomPoints(1100, 1), target = randomPoints(700, 2);
  const auto order = shuffled(source.cols(), 4);
  const Output straight = run(source, target, source);
  const Points other = select(source, order);
  const Output shuffled_output = run(other, select(target, shuffled(target.cols(), 5)), other);
  EXPECT_EQ(shuffled_output.transform, straight.transform);
  EXPECT_EQ(shuffled_output.displacements, select(straight.displacements, order));
}

TEST_P(NetworkDeterminism, buffersOfAnEarlierCallLeaveNoTrace) {
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    Network network(loudWeights(pairing), {3, pairing}, 2);
    const Points first = network.estimateDisplacements(source_, target_, queries_);
    const Eigen::Isometry3f rigid = network.estimateRigid(source_, target_);
    const Points large = 2.0F * randomPoints(501, 9);
    network.estimateDisplacements(large, large, large);
    network.estimateRigid(large, randomPoints(7, 9));
    EXPECT_EQ(network.estimateDisplacements(source_, target_, queries_), first);
    EXPECT_EQ(network.estimateRigid(source_, target_).matrix(), rigid.matrix());
  }
}

UNIRIT_ON_EVERY_INSTRUCTION_SET(NetworkDeterminism);

}  // namespace
}  // namespace unirit
