// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/trial.hpp"

#include <gtest/gtest.h>

#include "unirit/metrics.hpp"
#include "unirit/plausibility.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

constexpr Eigen::Index kPoints = 300;

const DeformedOrgan& liver() {
  static const DeformedOrgan organ(makePhantom("liver", 1), 2, 6000);
  return organ;
}

const DeformedOrgan& kidney() {
  static const DeformedOrgan organ(makePhantom("kidney", 3), 4, 6000);
  return organ;
}

Trial trial(TrialKind kind, int number) {
  return makeTrial(kind, number, liver(), kidney(), kPoints, 5);
}

double extentRatio(const Trial& trial) {
  return extent(trial.intraoperative.points) / extent(trial.preoperative.points);
}

/// Distance of each cloud point to the organ where it truly is, over the extent.
Eigen::RowVectorXf distancesToTruth(const Trial& trial) {
  return nearestDistances(trial.intraoperative.points, trial.truth) /
         static_cast<float>(extent(trial.preoperative.points));
}

double shareNear(const Trial& trial) {
  return (distancesToTruth(trial).array() < 0.06F).cast<double>().mean();
}

TEST(Trial, IsTheSameForASeedAndHasASentenceForEveryKind) {
  for (const TrialKind kind : trialKinds()) {
    for (int number = 0; number < 4; ++number) {
      const Trial one = trial(kind, number), again = trial(kind, number);
      EXPECT_EQ(one.kind, kind);
      EXPECT_EQ(one.intraoperative.points, again.intraoperative.points) << toString(kind);
      EXPECT_EQ(one.preoperative.points, again.preoperative.points) << toString(kind);
      EXPECT_TRUE(one.intraoperative.points.allFinite());
      EXPECT_STRNE(toString(kind), "unknown");
    }
  }
}

TEST(Trial, OrdinaryOnesTakeTurnsWithTheProtocols) {
  EXPECT_EQ(trial(TrialKind::kOrdinary, 0).protocol, Protocol::kResampled);
  EXPECT_EQ(trial(TrialKind::kOrdinary, 1).protocol, Protocol::kCaseB);
  EXPECT_EQ(trial(TrialKind::kOrdinary, 2).protocol, Protocol::kPartial);
  EXPECT_EQ(trial(TrialKind::kOrdinary, 3).protocol, Protocol::kIntraop);
  EXPECT_EQ(trial(TrialKind::kOrdinary, 9).protocol, Protocol::kCamera);
  EXPECT_GT(shareNear(trial(TrialKind::kOrdinary, 0)), 0.9);
}

TEST(Trial, IsRightWithinATenthOfTheExtentAndNotMuchWorseThanBefore) {
  Trial one = trial(TrialKind::kOrdinary, 0);
  EXPECT_TRUE(one.isRight(one.truth));
  EXPECT_TRUE(one.isRight(one.preoperative.points));
  const auto extent = static_cast<float>(unirit::extent(one.preoperative.points));
  const auto shifted = [&](float share) -> Points {
    return one.truth.colwise() + Eigen::Vector3f(share * extent, 0.0F, 0.0F);
  };
  EXPECT_NEAR(one.errorBefore(), 0.075, 0.02);
  EXPECT_TRUE(one.isRight(shifted(0.04F)));
  EXPECT_FALSE(one.isRight(shifted(0.11F)));  // too far from the truth
  one.truth = one.preoperative.points;        // where it began
  EXPECT_FALSE(one.isRight(shifted(0.04F)));  // led away
}

TEST(Trial, WithoutATruthNothingIsRight) {
  for (const TrialKind kind :
       {TrialKind::kOtherOrgan, TrialKind::kTableTop, TrialKind::kWrongUnit}) {
    const Trial one = trial(kind, 0);
    EXPECT_EQ(one.truth.cols(), 0);
    EXPECT_FALSE(one.isRight(one.preoperative.points));
    const Eigen::Vector3f start = centroid(moved(one.guess, one.preoperative.points));
    const Eigen::Vector3f target = centroid(one.intraoperative.points);
    EXPECT_LT((start - target).norm(), 1e-3F * (start.norm() + target.norm()) + 1e-5F);
  }
}

TEST(Trial, OtherOrgansAreTheOthers) {
  const Trial one = trial(TrialKind::kOtherOrgan, 0);
  const Points kidneys = kidney().pair(viewOf(Protocol::kResampled), kPoints, 5).target;
  EXPECT_EQ(one.intraoperative.points, kidneys);
}

TEST(Trial, TableTopsAreFlatOrBearObjects) {
  const auto thickness = [](int number) {
    const Points& cloud = trial(TrialKind::kTableTop, number).intraoperative.points;
    std::vector<PlausibilityCheck> checks;
    EXPECT_FALSE(findFault({cloud, {}}, "the cloud", {}, checks));  // no plain plane
    return checks.back().value;
  };
  EXPECT_LT(thickness(0), 0.1);
  EXPECT_GT(thickness(1), thickness(0));
}

TEST(Trial, WrongUnitsAreFarFromAnyOrgan) {
  for (int number = 0; number < 12; ++number) {
    const Trial one = trial(TrialKind::kWrongUnit, number);
    const double organ = extent(one.preoperative.points), ratio = extentRatio(one);
    EXPECT_TRUE(organ < 0.01 || organ > 1.0 || ratio < 0.05 || ratio > 10.0) << number;
  }
}

TEST(Trial, FarStartsAreTurnedAboutTheOrgansCentre) {
  for (int number = 0; number < 4; ++number) {
    const Trial one = trial(TrialKind::kFarStart, number);
    const Trial ordinary = trial(TrialKind::kOrdinary, number);
    EXPECT_GT(shareNear(one), 0.9);
    const Eigen::Isometry3d turn = bestRigidFit(ordinary.truth, one.truth);
    const double degrees = Eigen::AngleAxisd(turn.linear()).angle() * 180.0 / M_PI;
    EXPECT_GE(degrees, 60.0);
    EXPECT_LE(degrees, 180.0);
    EXPECT_LT((centroid(one.truth) - centroid(ordinary.truth)).norm(), 1e-4F);
    EXPECT_TRUE(one.guess.isApprox(Eigen::Isometry3d::Identity()));
  }
}

TEST(Trial, SmallViewsShowATenth) {
  const Trial one = trial(TrialKind::kSmallView, 0), ordinary = trial(TrialKind::kOrdinary, 2);
  const auto shown = [](const Trial& of) {
    const auto reach = static_cast<float>(0.05 * extent(of.truth));
    return (nearestDistances(of.truth, of.intraoperative.points).array() < reach)
        .cast<double>()
        .mean();
  };
  EXPECT_LT(shown(one), 0.3);
  EXPECT_GT(shown(ordinary), 0.4);
}

TEST(Trial, HalvesOfOtherOrgansLeaveAboutHalf) {
  const Trial one = trial(TrialKind::kHalfOther, 0);
  EXPECT_GT(one.truth.cols(), 0);
  const Points own = liver().pair(viewOf(Protocol::kResampled), kPoints, 5).target;
  const double kept =
      (nearestDistances(own, one.intraoperative.points).array() == 0.0F).cast<double>().mean();
  EXPECT_GT(kept, 0.3);
  EXPECT_LT(kept, 0.7);
}

}  // namespace
}  // namespace unirit
