// SPDX-License-Identifier: BSD-3-Clause
#include "refinement/correspondence.hpp"

#include <limits>

#include "allocation_counter.hpp"
#include "correspondence_reference.hpp"
#include "oriented_organ.hpp"

namespace unirit {
namespace {

using test::orientedOrgan;

PointCloud source() { return orientedOrgan(300, 1); }

/// Near the source, with normals that do not all look outwards.
PointCloud target(Eigen::Index count) {
  PointCloud target = orientedOrgan(count, 2);
  target.points.row(0).array() += 0.05F;
  target.normals.leftCols(count / 4) *= -1.0F;
  return target;
}

/// Everything from hidden to surely seen.
Eigen::RowVectorXf visibilityOf(const PointCloud& cloud) {
  Random random(5);
  return Eigen::RowVectorXf::NullaryExpr(
             cloud.size(), [&] { return static_cast<float>(random.uniform(-0.2, 1.2)); })
      .cwiseMax(0.0F)
      .cwiseMin(1.0F);
}

Correspondences estimated(const PointCloud& moving, const PointCloud& seen,
                          const Attraction& attraction, int threads = 2) {
  ThreadTeam team(threads);
  CorrespondenceEstimator estimator(selectKernels(), team);
  estimator.aimAt(seen);
  Correspondences correspondences;
  estimator.estimate(moving, visibilityOf(moving), attraction, correspondences);
  return correspondences;
}

reference::Expected expected(const PointCloud& moving, const PointCloud& seen,
                             const Attraction& attraction) {
  return reference::correspondences(moving, seen, visibilityOf(moving), attraction);
}

/// Of correspondences in single precision against the reference.
void expectNear(const Correspondences& found, const reference::Expected& wanted, double tolerance) {
  const Eigen::ArrayXd mass_error =
      (found.mass.cast<double>() - wanted.mass).array() / (1e-3 + wanted.mass.array());
  EXPECT_LT(mass_error.abs().maxCoeff(), tolerance);
  EXPECT_LT((found.positions.cast<double>() - wanted.positions).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((found.normals.cast<double>() - wanted.normals).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_NEAR(found.fit, wanted.fit, 10.0 * tolerance);
}

/// So wide that every point reaches every other: nothing is cut off.
Attraction wide(NormalUse normals = NormalUse::kSigned, float symmetry = 4.0F) {
  return {0.7F, 0.1F, normals, symmetry};
}

TEST(CorrespondencesOfBrokenClouds, WhatIsNotANumberIsNearNothing) {
  PointCloud moving = source();
  moving.points.col(3).setConstant(std::numeric_limits<float>::quiet_NaN());
  const Correspondences found = estimated(moving, target(130), wide());  // no whole number of balls
  EXPECT_EQ(found.mass[3], 0.0F);
  EXPECT_TRUE(found.mass.allFinite());
  EXPECT_GT(found.mass[4], 0.0F);
}

TEST(Correspondence, AreThoseOfDoublePrecision) {
  for (const NormalUse use : {NormalUse::kNone, NormalUse::kUnsigned, NormalUse::kSigned}) {
    for (const float symmetry : {0.0F, 1.0F, 4.0F}) {
      for (const float outliers : {0.01F, 0.3F}) {
        Attraction attraction = wide(use, symmetry);
        attraction.outlier_share = outliers;
        expectNear(estimated(source(), target(256), attraction),
                   expected(source(), target(256), attraction), 2e-5);
      }
    }
  }
}

TEST(Correspondence, TakeAnyNumberOfTargetPoints) {
  for (const int count : {20, 31, 33, 250}) {
    SCOPED_TRACE(count);
    expectNear(estimated(source(), target(count), wide()),
               expected(source(), target(count), wide()), 2e-5);
  }
  PointCloud few = target(20);
  for (const int count : {1, 3, 15, 16, 17}) {
    SCOPED_TRACE(count);
    const PointCloud first{few.points.leftCols(count), few.normals.leftCols(count)};
    for (const NormalUse use : {NormalUse::kNone, NormalUse::kUnsigned}) {
      expectNear(estimated(source(), first, wide(use)), expected(source(), first, wide(use)), 2e-5);
    }
  }
}

TEST(Correspondence, WithoutSymmetryVisibilityDoesNotMatter) {
  ThreadTeam team(1);
  const PointCloud moving = source(), seen = target(200);
  CorrespondenceEstimator estimator(selectKernels(), team);
  estimator.aimAt(seen);
  const auto massAt = [&](float visibility, float symmetry) {
    Correspondences correspondences;
    estimator.estimate(moving, Eigen::RowVectorXf::Constant(moving.size(), visibility),
                       wide(NormalUse::kSigned, symmetry), correspondences);
    return correspondences.mass.eval();
  };
  EXPECT_EQ(massAt(0.0F, 0.0F), massAt(1.0F, 0.0F));
  EXPECT_TRUE((massAt(0.0F, 4.0F).array() < massAt(1.0F, 4.0F).array()).all());
}

TEST(Correspondence, FitBestWhereTheSourceLiesOnTheTarget) {
  const Attraction attraction{0.1F, 0.1F, NormalUse::kSigned, 4.0F};
  const PointCloud seen = orientedOrgan(500, 2);
  double last = estimated(source(), seen, attraction).fit;
  for (const float shift : {0.1F, 0.2F, 0.4F}) {
    PointCloud moving = source();
    moving.points.row(1).array() += shift;
    const double fit = estimated(moving, seen, attraction).fit;
    EXPECT_LT(fit, last) << shift;
    last = fit;
  }
}

TEST(Correspondence, WithUnsignedNormalsTheirSignsDoNotMatter) {
  const PointCloud seen = target(500);
  PointCloud turned = seen;
  for (Eigen::Index j = 0; j < turned.size(); j += 3) turned.normals.col(j) *= -1.0F;
  const Correspondences expected = estimated(source(), seen, wide(NormalUse::kUnsigned));
  const Correspondences found = estimated(source(), turned, wide(NormalUse::kUnsigned));
  EXPECT_EQ(found.mass, expected.mass);
  EXPECT_EQ(found.positions, expected.positions);
  EXPECT_EQ(found.normals, expected.normals);
  EXPECT_NE(estimated(source(), turned, wide()).mass, expected.mass);
}

TEST(Correspondence, HaveTheSameBitsForAnyNumberOfThreads) {
  for (const float sigma : {0.02F, 0.1F, 0.7F}) {
    const Attraction attraction{sigma, 0.1F, NormalUse::kSigned, 4.0F};
    const Correspondences alone = estimated(source(), target(500), attraction, 1);
    for (const int threads : {2, 3}) {
      const Correspondences shared = estimated(source(), target(500), attraction, threads);
      EXPECT_EQ(shared.mass, alone.mass);
      EXPECT_EQ(shared.positions, alone.positions);
      EXPECT_EQ(shared.normals, alone.normals);
      EXPECT_EQ(shared.fit, alone.fit);
    }
  }
}

TEST(Correspondence, DoNotDependOnTheOrderOfTheTarget) {
  const PointCloud seen = target(500);
  const PointCloud other{test::shuffled(seen.points, 3), test::shuffled(seen.normals, 3)};
  for (const float sigma : {0.05F, 0.7F}) {
    const Attraction attraction{sigma, 0.1F, NormalUse::kSigned, 4.0F};
    const Correspondences a = estimated(source(), seen, attraction),
                          b = estimated(source(), other, attraction);
    EXPECT_LT((a.mass - b.mass).cwiseAbs().maxCoeff(), 1e-5F);
    EXPECT_LT((a.positions - b.positions).cwiseAbs().maxCoeff(), 1e-5F);
    EXPECT_LT((a.normals - b.normals).cwiseAbs().maxCoeff(), 1e-4F);
  }
}

/// Whatever blocks are passed over, only pairs beyond the reach are left out: the masses lie
/// between those with all such pairs gone from the numerators and those with them gone from the
/// denominators.
TEST(Correspondence, LeaveOutNoPairWithinReach) {
  const PointCloud moving = source(), seen = target(500);
  const Eigen::RowVectorXf visibility = visibilityOf(moving);
  for (const float sigma : {0.03F, 0.1F}) {
    const Attraction attraction{sigma, 0.1F, NormalUse::kSigned, 4.0F};
    Eigen::MatrixXd signs;
    const Eigen::MatrixXd all = reference::affinities(
        moving, seen, attraction, std::numeric_limits<double>::infinity(), signs);
    const Eigen::MatrixXd near = reference::affinities(
        moving, seen, attraction, reference::kReach * static_cast<double>(sigma), signs);
    const double background = reference::background(seen, attraction);
    const auto mass = [&](const Eigen::MatrixXd& affinity, const Eigen::MatrixXd& sums) {
      return Eigen::ArrayXd(
          reference::responsibilities(affinity, sums, background, visibility, attraction)
              .rowwise()
              .sum());
    };
    const Eigen::ArrayXd found =
        estimated(moving, seen, attraction).mass.transpose().cast<double>();
    EXPECT_TRUE((found >= mass(near, all) - 2e-5).all()) << "sigma " << sigma;
    EXPECT_TRUE((found <= mass(all, near) + 2e-5).all()) << "sigma " << sigma;
    // What is left out hardly counts
    EXPECT_LT((found - mass(all, all)).abs().mean(), 2e-3);
  }
}

TEST(Correspondence, FarAwayOutliersAttractNothing) {
  PointCloud seen = target(160);
  PointCloud with_outliers{Points(3, 163), Points(3, 163)};
  with_outliers.points << seen.points, Points::Constant(3, 3, 1.0F);
  with_outliers.points.rightCols(3) *= Eigen::Vector3f(30.0F, -40.0F, 50.0F).asDiagonal();
  with_outliers.normals << seen.normals, Eigen::Vector3f::UnitX().replicate(1, 3);
  const Attraction attraction{0.3F, 0.1F, NormalUse::kSigned, 4.0F};
  const Correspondences found = estimated(source(), with_outliers, attraction);
  expectNear(found, expected(source(), with_outliers, attraction), 5e-3);
  EXPECT_LT(found.positions.cwiseAbs().maxCoeff(), 2.0F);
  EXPECT_TRUE(found.normals.allFinite());
}

TEST(Correspondence, SourcePointsBeyondAllTargetsStayWhereTheyAre) {
  PointCloud moving = source();
  moving.points.leftCols(50).array() += 20.0F;
  const Correspondences found =
      estimated(moving, target(200), {0.1F, 0.1F, NormalUse::kSigned, 4.0F});
  EXPECT_EQ(found.mass.head(50), Eigen::RowVectorXf::Zero(50));
  EXPECT_EQ(found.positions.leftCols(50), moving.points.leftCols(50));
  EXPECT_EQ(found.normals.leftCols(50), Points::Zero(3, 50));
  EXPECT_GT(found.mass.tail(250).minCoeff(), 0.0F);
}

class CorrespondenceAllocation : public testing::Test {
 protected:
  void SetUp() override { test::requireCounting(); }
};

TEST_F(CorrespondenceAllocation, NothingIsAllocatedAfterTheFirstCall) {
  const PointCloud moving = source(), seen = target(500);
  const Eigen::RowVectorXf visibility = visibilityOf(moving);
  for (const int threads : {1, 2}) {
    ThreadTeam team(threads);
    CorrespondenceEstimator estimator(selectKernels(), team);
    estimator.aimAt(seen);
    Correspondences correspondences;
    const auto estimate = [&] {
      estimator.estimate(moving, visibility, {0.1F, 0.1F, NormalUse::kSigned, 4.0F},
                         correspondences);
    };
    EXPECT_GT(test::countAllocations(estimate), 0) << "the first call sizes the buffers";
    EXPECT_EQ(test::countAllocations(estimate), 0) << threads << " threads";
  }
}

}  // namespace
}  // namespace unirit
