// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <optional>

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

/// Registers views of one organ, as a stream of them.
class Stream {
 public:
  explicit Stream(const RegistrationPair& pair, int warm_iterations = 8)
      : organ_{pair.source, pair.source_normals},
        registrar_(std::make_shared<const Weights>(randomWeights(NetworkSettings().pairing, 1)),
                   settings(warm_iterations)) {}

  Registration next(const RegistrationPair& view) { return next(view, nullptr); }
  Registration from(const Eigen::Isometry3d& guess, const RegistrationPair& view) {
    return registrar_.registerClouds(organ_, {view.target, {}, view.viewpoint}, guess);
  }
  Registration next(const RegistrationPair& view, const Registration& before) {
    const Earlier earlier{before.T_intraoperative_preoperative, before.deformation,
                          before.next_fit};
    return next(view, &earlier);
  }

 private:
  Registration next(const RegistrationPair& view, const Earlier* earlier) {
    return registrar_.registerClouds(organ_, {view.target, {}, view.viewpoint},
                                     Eigen::Isometry3d::Identity(), earlier);
  }

  static RegistrationSettings settings(int warm_iterations) {
    RegistrationSettings settings;
    settings.stages = {Stage::kRefine};
    settings.refinement.warm_iterations = warm_iterations;
    settings.plausibility = test::lenientLimits();
    return settings;
  }

  PointCloud organ_;
  Registrar registrar_;
};

double errorOf(const Registration& registration, const RegistrationPair& pair) {
  return rootMeanSquareDistance(registration.deformation->movedSurface(), pair.truth);
}

/// The view, moved a little as between two images of a camera.
RegistrationPair nudged(RegistrationPair pair) {
  const Eigen::Isometry3d motion = Eigen::Translation3d(0.002, -0.001, 0.001) *
                                   Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY());
  pair.target = moved(motion, pair.target);
  pair.truth = moved(motion, pair.truth);
  if (pair.viewpoint) pair.viewpoint = (motion * pair.viewpoint->cast<double>()).cast<float>();
  return pair;
}

TEST(WarmStart, IsAsAccurateAsAColdOne) {
  for (const char* organ : kOrgans) {
    for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
      const RegistrationPair first = pairOf(organ, protocol), second = nudged(first);
      Stream stream(first);
      const Registration before = stream.next(first);
      const double cold = errorOf(stream.next(second), second);
      const double warm = errorOf(stream.next(second, before), second);
      EXPECT_LT(warm, 1.1 * cold) << organ << " " << toString(protocol);
    }
  }
}

TEST(WarmStart, IsNotAskedWhetherTheOrganFitsBetterFlipped) {
  const RegistrationPair pair = pairOf("liver", Protocol::kPartial);
  Stream stream(pair);
  const Registration cold = stream.next(pair);
  ASSERT_TRUE(cold.refinement && cold.refinement->flip_gain);
  EXPECT_LT(*cold.refinement->flip_gain, 0.0);
  const Registration warm = stream.next(pair, cold);
  ASSERT_TRUE(warm.refinement);
  EXPECT_FALSE(warm.refinement->flip_gain);
}

TEST(WarmStart, BeginsWhereTheRegistrationBeforeEnded) {
  const RegistrationPair pair = pairOf("liver", Protocol::kResampled);
  Stream stream(pair, 1);
  const Registration before = stream.next(pair);
  Registration still = before;  // the same pose without its displacement
  still.deformation = std::make_shared<const Deformation>(before.T_intraoperative_preoperative,
                                                          pair.source, Points::Zero(3, 1024));
  const double after = errorOf(stream.next(pair, before), pair);
  EXPECT_LT(after, 1.2 * errorOf(before, pair));
  EXPECT_LT(after, errorOf(stream.next(pair, still), pair));
}

TEST(WarmStart, DoesNotDriftOverOneViewSeenAgainAndAgain) {
  for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
    const RegistrationPair pair = pairOf("kidney", protocol);
    Stream stream(pair);
    Registration last = stream.next(pair);
    const double first = errorOf(last, pair);
    for (int i = 0; i < 30; ++i) last = stream.next(pair, last);
    EXPECT_LT(errorOf(last, pair), 1.2 * first) << toString(protocol);
  }
}

TEST(WarmStart, ExpectsTheNextViewWhereTheGuessWasUnlessThatWasFarOff) {
  const RegistrationPair pair = pairOf("kidney", Protocol::kPartial);
  const double half = 0.5 * extent(pair.source);
  Stream stream(pair);
  const Eigen::Isometry3d near = Eigen::Isometry3d::Identity();
  EXPECT_LT((stream.next(pair).next_guess.translation() - near.translation()).norm(), 0.1 * half);
  const Eigen::Isometry3d far(Eigen::Translation3d(0.3 * half, 0, 0));
  const Eigen::Isometry3d next = stream.from(far, pair).next_guess;
  EXPECT_LT(next.translation().norm(), 0.7 * far.translation().norm());
}

/// A stream whose next view begins with a displacement that is none of this organ's.
class LostWarmStart : public testing::Test {
 protected:
  LostWarmStart() {
    lost_.deformation = std::make_shared<const Deformation>(Eigen::Isometry3d::Identity(),
                                                            pair_.source, 0.5F * pair_.source);
  }

  /// Of the same view again.
  Registration next(std::optional<double> expected_fit) {
    lost_.next_fit = expected_fit;
    return stream_.next(pair_, lost_);
  }

  const RegistrationPair pair_ = pairOf("spleen", Protocol::kCaseB);
  Stream stream_{pair_, 1};
  const Registration cold_ = stream_.next(pair_);
  Registration lost_ = cold_;
};

TEST_F(LostWarmStart, GivesWayToAWholeSearchWhereItFitsPoorly) {
  for (const std::optional<double> fit : {cold_.next_fit, std::optional<double>()}) {
    EXPECT_LT(errorOf(next(fit), pair_), 1.1 * errorOf(cold_, pair_));
  }
}

TEST_F(LostWarmStart, IsNotFollowedByASearchWhereItFitsAsTheViewBefore) {
  EXPECT_GT(errorOf(next(-100.0), pair_), 2.0 * errorOf(cold_, pair_));
}

TEST_F(LostWarmStart, ExpectsNoMoreThanAWholeSearchFound) {
  const Registration found = next(0.0);  // better than any
  EXPECT_LT(*found.next_fit, 0.0);
  EXPECT_EQ(found.next_fit, found.refinement->fit);

  RegistrationPair scattered = pair_;  // which nothing fits
  scattered.target = extent(pair_.source) / 2.0F * Points::Random(3, 1024);
  const Registration poor = stream_.next(scattered, cold_);
  EXPECT_LT(*poor.next_fit, *cold_.next_fit - 1.0);
  EXPECT_EQ(poor.next_fit, poor.refinement->fit);
}

TEST(WarmStart, HandsOnTheBestFitOfTheStream) {
  const RegistrationPair pair = pairOf("kidney", Protocol::kPartial);
  Stream stream(pair);
  Registration before = stream.next(pair);
  ASSERT_TRUE(before.refinement && before.next_fit);
  EXPECT_EQ(*before.next_fit, before.refinement->fit);
  before.next_fit = before.refinement->fit - 10.0;
  const Registration better = stream.next(pair, before);
  EXPECT_EQ(better.next_fit, better.refinement->fit);
  before.next_fit = before.refinement->fit + 0.1;
  EXPECT_EQ(stream.next(pair, before).next_fit, before.next_fit);
}

}  // namespace
}  // namespace unirit
