// SPDX-License-Identifier: BSD-3-Clause
#include "refinement/refinement.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "allocation_counter.hpp"
#include "refinement_problem.hpp"
#include "shapes.hpp"
#include "unirit/metrics.hpp"
#include "unirit/random.hpp"

namespace unirit {
namespace {

using test::kOrgans;
using test::Outcome;
using test::pairOf;
using test::Problem;

RefinementSettings pointwise() {
  RefinementSettings settings;
  settings.correspondence = Correspondence::kPoints;
  return settings;
}

/// RMSE against the truth before and after refinement, of several phantoms.
struct Errors {
  explicit Errors(Protocol protocol) {
    for (const char* organ : kOrgans) {
      for (const std::uint64_t seed : {1, 2, 3, 4}) {
        const RegistrationPair pair = pairOf(organ, protocol, seed);
        const Problem problem(pair);
        const Points moved = Outcome(problem).metres(problem.normalisation);
        const double before = rootMeanSquareDistance(pair.source, pair.truth);
        const double after = rootMeanSquareDistance(moved, pair.truth);
        sum_before += before;
        sum_after += after;
        worst = std::max(worst, after / before);
      }
    }
  }

  double mean() const { return sum_after / sum_before; }

  double worst = 0.0;  ///< error after over that before
  double sum_before = 0.0, sum_after = 0.0;
};

TEST(Refinement, ComesNearerToTheTruthOnWholeSurfaces) {
  const Errors errors(Protocol::kResampled);
  EXPECT_LT(errors.mean(), 0.7);
  EXPECT_LT(errors.worst, 0.95);
}

TEST(Refinement, FindsThePoseOfWholeSurfacesToo) {
  const Errors errors(Protocol::kCaseB);
  EXPECT_LT(errors.mean(), 0.4);
  EXPECT_LT(errors.worst, 0.6);
}

/// Motion along the surface hardly shows on these smooth organs, so single ones may end worse.
TEST(Refinement, ComesNearerToTheTruthInTheMeanOnViewsOfOneSide) {
  const Errors clean(Protocol::kPartial);
  EXPECT_LT(clean.mean(), 0.95);
  EXPECT_LT(clean.worst, 1.5);
  const Errors noisy(Protocol::kIntraop);
  EXPECT_LT(noisy.mean(), 0.9);
  EXPECT_LT(noisy.worst, 1.3);
}

TEST(Refinement, FindsEachPointAmongTheSamePoints) {
  for (const char* organ : kOrgans) {
    const RegistrationPair pair = pairOf(organ, Protocol::kPermuted, 3);
    const Problem problem(pair);
    const double error = rootMeanSquareDistance(
        Outcome(problem, pointwise()).metres(problem.normalisation), pair.truth);
    EXPECT_LT(error, 0.002) << organ;
    EXPECT_GT(rootMeanSquareDistance(pair.source, pair.truth), 0.005) << organ;
  }
}

TEST(Refinement, TellsWholeSurfacesFromViewsOfOneSide) {
  for (const char* organ : kOrgans) {
    EXPECT_TRUE(Outcome(Problem(pairOf(organ, Protocol::kResampled, 1))).sighting.whole) << organ;
    EXPECT_FALSE(Outcome(Problem(pairOf(organ, Protocol::kPartial, 1))).sighting.whole) << organ;
  }
}

PointCloud joined(const PointCloud& a, const PointCloud& b) {
  PointCloud both{Points(3, a.size() + b.size()), Points(3, a.size() + b.size())};
  both.points << a.points, b.points;
  both.normals << a.normals, b.normals;
  return both;
}

/// One surface of a bowl that is open at the top: a lower half sphere, normals outwards or inwards.
PointCloud halfSphere(float radius, bool outwards, Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  PointCloud half{Points(3, count), Points(3, count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    Eigen::Vector3f direction = random.direction().cast<float>();
    direction.z() = -std::abs(direction.z());
    half.points.col(i) = radius * direction;
    half.normals.col(i) = outwards ? direction : Eigen::Vector3f(-direction);
  }
  return half;
}

TEST(Refinement, BelievesTheViewpointOfAHollowSeenFromWithinButNoWrongOne) {
  const PointCloud bowl = joined(halfSphere(1.0F, true, 600, 1), halfSphere(0.7F, false, 300, 2));
  ThreadTeam team(1);
  Refinement refinement(bowl, {}, selectKernels(), team);

  const Eigen::Vector3f above(0.2F, 0.1F, 4.0F);
  const Points within = halfSphere(0.7F, false, 400, 3).points;
  const Sighting hollow = refinement.sight({within, {}, above});
  ASSERT_FALSE(hollow.whole);
  EXPECT_EQ(*hollow.eye, above);
  EXPECT_LT(hollow.seen.normals.cwiseProduct(hollow.seen.points).colwise().sum().mean(), -0.6F);
  EXPECT_GT(refinement.sight({within, {}}).eye->z(), 1.0F);

  const Sighting back = refinement.sight({halfSphere(1.0F, true, 600, 4).points, {}, above});
  ASSERT_FALSE(back.whole);
  EXPECT_LT(back.eye->z(), -1.0F);
}

/// One face of a flat lobe: a square of side 1.6 at a height of z, normals up or down.
PointCloud face(float z, bool up, Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  PointCloud made{Points(3, count), Points::Zero(3, count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    made.points.col(i) = random.uniformVector({-0.8, -0.8, z}, {0.8, 0.8, z}).cast<float>();
  }
  made.normals.row(2).setConstant(up ? 1.0F : -1.0F);
  return made;
}

TEST(Refinement, DoesNotDrawAHiddenLobeToTheOneThatHidesIt) {
  const PointCloud front = joined(face(0.2F, true, 225, 1), face(0.1F, false, 225, 2));
  const PointCloud back = joined(face(-0.1F, true, 225, 3), face(-0.2F, false, 225, 4));
  const PointCloud both = joined(front, back);
  const Points seen = face(0.2F, true, 400, 5).points;
  ThreadTeam team(1);
  Refinement refinement(both, {}, selectKernels(), team);

  const Sighting sighting = refinement.sight({seen, {}, Eigen::Vector3f(0, 0, 4)});
  ASSERT_FALSE(sighting.whole);
  const Refined refined =
      refinement.refine(sighting, {Eigen::Isometry3f::Identity(), Points::Zero(3, 900)});
  const Points moved = refined.pose * (both.points + refinement.prior()->displacements(
                                                         both.points, refined.coefficients));
  EXPECT_LT(rootMeanSquareDistance(both.points, moved), 0.03);
}

TEST(Refinement, FitsBetterFlippedWhereItLiesUpsideDown) {
  for (const char* organ : kOrgans) {
    for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
      Problem problem(pairOf(organ, protocol, 1));
      Outcome found(problem);
      const auto gain = [&](const Eigen::Isometry3f& pose) {
        return found.refinement.flipGain(found.sighting, pose);
      };
      EXPECT_LT(gain(found.refined.pose), 0.0) << organ << ' ' << toString(protocol);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> axes(problem.source.points *
                                                                problem.source.points.transpose());
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Isometry3f flip(
            Eigen::AngleAxisf(static_cast<float>(M_PI), axes.eigenvectors().col(axis)));
        EXPECT_GT(gain(found.refined.pose * flip), 0.0)
            << organ << ' ' << toString(protocol) << " about axis " << axis;
      }
    }
  }
}

TEST(BeyondExpectation, IsNothingOfASmallPoseAndNearlyAllOfALargeOne) {
  const auto pose = [](float turn, float shift) -> Eigen::Isometry3f {
    return Eigen::Translation3f(shift, 0, 0) * Eigen::AngleAxisf(turn, Eigen::Vector3f::UnitY());
  };
  EXPECT_TRUE(beyondExpectation(Eigen::Isometry3f::Identity()).isApprox(pose(0, 0)));
  EXPECT_TRUE(beyondExpectation(pose(0.03F, 0.02F)).isApprox(pose(0, 0)));
  EXPECT_TRUE(beyondExpectation(pose(0.7F, 0)).isApprox(pose(0.63F, 0), 1e-3F));
  EXPECT_TRUE(beyondExpectation(pose(0, 0.35F)).isApprox(pose(0, 0.315F), 1e-3F));
}

TEST(Refinement, RotatesWithBothClouds) {
  for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
    Problem problem(pairOf("liver", protocol, 1));
    const Outcome straight(problem);
    const Eigen::Matrix3f rotation =
        Eigen::AngleAxisf(1.0F, Eigen::Vector3f(1, -2, 3).normalized()).toRotationMatrix();
    problem.rotate(rotation);
    const Outcome turned(problem);
    const double difference = rootMeanSquareDistance(rotation * straight.moved, turned.moved);
    EXPECT_LT(difference, 1e-3) << toString(protocol);
  }
}

TEST(Refinement, DoesNotDependOnTheOrderOfTheTarget) {
  Problem problem(pairOf("liver", Protocol::kPartial, 1));
  const Outcome straight(problem);
  problem.target.points = test::shuffled(problem.target.points, 4);
  const double difference = rootMeanSquareDistance(straight.moved, Outcome(problem).moved);
  EXPECT_LT(difference, 1e-3);
}

TEST(Refinement, HasTheSameBitsForAnyNumberOfThreadsAndAnyHistory) {
  const Problem problem(pairOf("kidney", Protocol::kPartial, 1));
  const Problem other(pairOf("kidney", Protocol::kCaseB, 1));
  const Outcome alone(problem, {}, 1);
  for (const int threads : {1, 2, 3}) {
    Outcome again(problem, {}, threads);
    again.refine(other);
    EXPECT_NE(again.moved, alone.moved);
    again.refine(problem);
    EXPECT_EQ(again.moved, alone.moved);
    EXPECT_EQ(again.refined.covariance_factor, alone.refined.covariance_factor);
  }
}

class RefinementAllocation : public testing::Test {
 protected:
  void SetUp() override { test::requireCounting(); }
};

TEST_F(RefinementAllocation, IsNoneFromANearStartAfterTheFirst) {
  for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
    for (const int threads : {1, 2}) {
      const Problem problem(pairOf("liver", protocol, 1));
      Outcome found(problem, {}, threads);
      const SearchStart near{found.refined.pose,
                             found.refinement.prior()->displacements(problem.source.points,
                                                                     found.refined.coefficients),
                             true};
      const auto refine = [&] { found.refinement.refine(found.sighting, near, found.refined); };
      refine();
      EXPECT_EQ(test::countAllocations(refine), 0) << toString(protocol) << ' ' << threads;
    }
  }
}

TEST(Refinement, StaysFiniteOnTargetsThatFixNothing) {
  const RegistrationPair pair = pairOf("liver", Protocol::kResampled, 1);
  Points line = Points::Zero(3, 60);
  line.row(1).setLinSpaced(-0.1F, 0.1F);
  const Points one_point = Eigen::Vector3f(0.02F, 0.01F, 0.0F).replicate(1, 60);
  const Points far = pair.target.array() + 2.0F;
  for (const Points& target : {line, one_point, far, Points(pair.target.leftCols(3))}) {
    RegistrationPair poor = pair;
    poor.target = target;
    const Outcome outcome{Problem(poor)};
    EXPECT_TRUE(outcome.moved.allFinite());
    EXPECT_LT((outcome.moved - Problem(poor).source.points).cwiseAbs().maxCoeff(), 3.0F);
  }
}

}  // namespace
}  // namespace unirit
