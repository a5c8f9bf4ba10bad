// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "lenient_limits.hpp"
#include "unirit/evaluation/pair.hpp"
#include "unirit/registration.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

const char* const kOrgans[] = {"liver", "kidney", "spleen"};

RegistrationPair pairOf(const std::string& organ, Protocol protocol) {
  return makePair(makePhantom(organ, 2, 3000), protocol, 1024, 2);
}

PointCloud organ(const RegistrationPair& pair) { return {pair.source, pair.source_normals}; }

PointCloud seen(const RegistrationPair& pair) { return {pair.target, {}, pair.viewpoint}; }

/// With a network that knows nothing.
Registration registered(const PointCloud& preoperative, const PointCloud& intraoperative,
                        const std::vector<Stage>& stages,
                        Correspondence correspondence = Correspondence::kSurface) {
  static const auto weights =
      std::make_shared<const Weights>(randomWeights(NetworkSettings().pairing, 1));
  RegistrationSettings settings;
  settings.stages = stages;
  settings.refinement.correspondence = correspondence;
  settings.plausibility = test::lenientLimits();
  Registrar registrar(weights, settings);
  return registrar.registerClouds(preoperative, intraoperative, Eigen::Isometry3d::Identity());
}

Registration refined(const RegistrationPair& pair) {
  return registered(organ(pair), seen(pair), {Stage::kRefine});
}

double errorOf(const Registration& registration, const RegistrationPair& pair) {
  return rootMeanSquareDistance(registration.deformation->movedSurface(), pair.truth);
}

TEST(RegistrationStages, AreRunAndTimedAsChosen) {
  const RegistrationPair pair = pairOf("liver", Protocol::kResampled);
  const Stage rigid = Stage::kRigid, nonrigid = Stage::kNonRigid, refine = Stage::kRefine;
  const std::vector<std::pair<std::vector<Stage>, std::string>> choices{
      {{rigid, nonrigid, refine}, "sampling refine assessment "},
      {{refine}, "sampling refine assessment "},
      {{rigid, nonrigid}, "sampling rigid nonrigid assessment "}};
  for (const auto& [stages, names] : choices) {
    const Registration registration = registered(organ(pair), seen(pair), stages);
    ASSERT_TRUE(registration.succeeded()) << registration.message;
    std::string timed;
    for (const StageTime& time : registration.stages) {
      timed += time.stage + " ";
      EXPECT_GT(time.milliseconds, 0.0) << time.stage;
    }
    EXPECT_EQ(timed, names);
  }
}

TEST(RegistrationStages, TheNetworkRunsWhereTheRefinementFitsPoorly) {
  const RegistrationPair pair = pairOf("liver", Protocol::kResampled);
  const PointCloud nothing{0.2F * Points::Random(3, 1024), {}};
  const auto stages = registered(organ(pair), nothing, {Stage::kRigid, Stage::kRefine}).stages;
  const auto ran = [&](const char* name) {
    return std::any_of(stages.begin(), stages.end(),
                       [&](const StageTime& time) { return time.stage == name; });
  };
  EXPECT_TRUE(ran("rigid"));
  EXPECT_FALSE(ran("nonrigid"));
}

TEST(RegistrationStages, RefinementAloneComesNearerToTheTruth) {
  for (const char* name : kOrgans) {
    for (const Protocol protocol : {Protocol::kResampled, Protocol::kCaseB, Protocol::kIntraop}) {
      const RegistrationPair pair = pairOf(name, protocol);
      const double before = rootMeanSquareDistance(pair.source, pair.truth);
      EXPECT_LT(errorOf(refined(pair), pair), 0.95 * before) << name << " " << toString(protocol);
    }
  }
}

TEST(RegistrationStages, AnUntrainedNetworkDoesNoHarmBeforeTheRefinement) {
  for (const char* name : kOrgans) {
    const RegistrationPair pair = pairOf(name, Protocol::kCaseB);
    const double before = rootMeanSquareDistance(pair.source, pair.truth);
    const Registration bare =
        registered(organ(pair), seen(pair), {Stage::kRigid, Stage::kNonRigid});
    const Registration whole =
        registered(organ(pair), seen(pair), {Stage::kRigid, Stage::kNonRigid, Stage::kRefine});
    EXPECT_GT(errorOf(bare, pair), 0.9 * before) << name << ": should not help by itself";
    EXPECT_LT(errorOf(whole, pair), 0.8 * before) << name;
  }
}

/// By quarter turns: others change the largest coordinate, which is the network's unit.
TEST(RegistrationStages, RefinementMovesAlongWithBothClouds) {
  for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
    const RegistrationPair pair = pairOf("liver", protocol);
    Eigen::Isometry3f motion = Eigen::Isometry3f::Identity();
    motion.linear() << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    motion.translation() << 0.25F, -0.5F, 0.125F;
    RegistrationPair far = pair;
    far.source = motion * pair.source;
    far.source_normals = motion.linear() * pair.source_normals;
    far.target = motion * pair.target;
    if (pair.viewpoint) far.viewpoint = motion * *pair.viewpoint;
    const Points near_result = refined(pair).deformation->movedSurface();
    const double difference =
        rootMeanSquareDistance(refined(far).deformation->movedSurface(), motion * near_result);
    EXPECT_LT(difference, 1e-5) << toString(protocol);
  }
}

TEST(RegistrationStages, RefinementTakesAViewpointThatIsNotFiniteForNone) {
  RegistrationPair pair = pairOf("liver", Protocol::kCamera);
  pair.viewpoint.reset();
  const Points without = refined(pair).deformation->movedSurface();
  for (const float odd : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    pair.viewpoint = Eigen::Vector3f(0.0F, odd, 1.0F);
    EXPECT_EQ(refined(pair).deformation->movedSurface(), without) << odd;
  }
}

TEST(RegistrationStages, CorrespondenceByPointsFindsEachPoint) {
  const RegistrationPair pair = pairOf("kidney", Protocol::kPermuted);
  const auto error = [&](Correspondence correspondence) {
    return errorOf(registered(organ(pair), seen(pair), {Stage::kRefine}, correspondence), pair);
  };
  EXPECT_LT(error(Correspondence::kPoints), 0.002);
  EXPECT_LT(error(Correspondence::kPoints), 0.5 * error(Correspondence::kSurface));
}

TEST(RegistrationStages, NormalsOfTheOrganAreEstimatedWhereItHasNone) {
  const RegistrationPair pair = pairOf("liver", Protocol::kResampled);
  const double with = errorOf(refined(pair), pair);
  const double without = errorOf(registered({pair.source, {}}, seen(pair), {Stage::kRefine}), pair);
  EXPECT_NEAR(without, with, 0.1 * with);
}

TEST(RefinedDeformation, MovesTheSurfaceAsAnyOtherPoint) {
  const RegistrationPair pair = pairOf("liver", Protocol::kResampled);
  const auto deformation = refined(pair).deformation;
  const Eigen::Index half = pair.source.cols() / 2;
  EXPECT_LT(
      (deformation->move(pair.source.rightCols(half)) - deformation->movedSurface().rightCols(half))
          .cwiseAbs()
          .maxCoeff(),
      1e-6F);
}

TEST(RefinedDeformation, MovesTheInsideSmoothlyAndNearerToTheTruth) {
  for (const char* name : kOrgans) {
    const RegistrationPair pair = pairOf(name, Protocol::kResampled);
    const auto deformation = refined(pair).deformation;
    EXPECT_LT(rootMeanSquareDistance(deformation->move(pair.interior), pair.interior_truth),
              0.9 * rootMeanSquareDistance(pair.interior, pair.interior_truth))
        << name;

    // Along a line through the organ and beyond, steps are stretched or turned, but never folded
    Points line = Points::Zero(3, 401);
    line.row(0).setLinSpaced(-0.2F, 0.2F);
    const Points moved = deformation->move(line);
    ASSERT_TRUE(moved.allFinite());
    const Points steps = moved.rightCols(400) - moved.leftCols(400);
    const Points rigid = deformation->moveRigidly(line);
    const Points rigid_steps = rigid.rightCols(400) - rigid.leftCols(400);
    EXPECT_LT((steps - rigid_steps).colwise().norm().maxCoeff(), 0.8F * 0.001F) << name;
  }
}

TEST(RegistrationStages, RefuseOtherOrgansAndAcceptTheirOwn) {
  RegistrationSettings settings;
  settings.stages = {Stage::kRefine};
  Registrar registrar(std::make_shared<const Weights>(randomWeights(NetworkSettings().pairing, 1)),
                      settings);
  std::map<std::string, RegistrationPair> pairs;
  for (const std::string& name : phantomOrgans()) pairs[name] = pairOf(name, Protocol::kResampled);
  int others = 0, others_refused = 0;
  for (const auto& [name, own] : pairs) {
    for (const auto& [other_name, other] : pairs) {
      const Registration registration = registrar.registerClouds(
          organ(own), seen(other), alignCentroids(organ(own), seen(other)));
      if (name == other_name) {
        EXPECT_TRUE(registration.succeeded()) << name << ": " << registration.message;
        continue;
      }
      ++others;
      others_refused += registration.succeeded() ? 0 : 1;
    }
  }
  EXPECT_GE(others_refused, others * 9 / 10);
}

TEST(RefinedDeformation, KnowsItsConfidenceAnywhereUnlikeTheNetworks) {
  const RegistrationPair pair = pairOf("spleen", Protocol::kPartial);
  const Eigen::RowVectorXf confidence = refined(pair).deformation->confidence(pair.interior);
  ASSERT_EQ(confidence.size(), pair.interior.cols());
  EXPECT_GE(confidence.minCoeff(), 0.0F);
  EXPECT_LE(confidence.maxCoeff(), 1.0F);
  EXPECT_GT(confidence.maxCoeff(), confidence.minCoeff());
  const Registration network =
      registered(organ(pair), seen(pair), {Stage::kRigid, Stage::kNonRigid});
  EXPECT_EQ(network.deformation->confidence(pair.interior).size(), 0);
  EXPECT_EQ(network.deformation->deviations().size(), 0);
}

}  // namespace
}  // namespace unirit
