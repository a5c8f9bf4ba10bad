// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/registration.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "lenient_limits.hpp"
#include "shapes.hpp"

namespace unirit {
namespace {

using test::bumpyEllipsoid;
using test::shuffled;

std::shared_ptr<const Weights> weights() {
  static const auto weights =
      std::make_shared<const Weights>(randomWeights(NetworkSettings().pairing, 1));
  return weights;
}

/// Limits that random weights do not reach.
RegistrationSettings lenient() {
  RegistrationSettings settings;
  settings.plausibility = test::lenientLimits();
  return settings;
}

PointCloud organ() { return {bumpyEllipsoid(3000, 1), {}}; }

PointCloud seen() {
  PointCloud cloud{bumpyEllipsoid(2000, 2), {}};
  cloud.points.row(0).array() += 0.01F;
  return cloud;
}

Registration registered(const PointCloud& preoperative, const PointCloud& intraoperative,
                        const Eigen::Isometry3d& guess = Eigen::Isometry3d::Identity()) {
  Registrar registrar(weights(), lenient());
  return registrar.registerClouds(preoperative, intraoperative, guess);
}

std::string inputFault(const PointCloud& preoperative, const PointCloud& intraoperative) {
  const Registration registration = registered(preoperative, intraoperative);
  EXPECT_EQ(registration.status, Status::kInvalidInput);
  EXPECT_EQ(registration.deformation, nullptr);
  return registration.message;
}

TEST(Registration, MovesEveryPreoperativePointAndNamesItsStages) {
  const Registration registration = registered(organ(), seen());
  ASSERT_TRUE(registration.succeeded()) << registration.message;
  EXPECT_EQ(registration.deformation->movedSurface().cols(), 3000);
  ASSERT_EQ(registration.stages.size(), 3U);  // it fits well, so the network is passed over
  EXPECT_EQ(registration.stages[0].stage, "sampling");
  EXPECT_EQ(registration.stages[1].stage, "refine");
  EXPECT_EQ(registration.stages[2].stage, "assessment");
  EXPECT_GT(registration.displacement.max, 0.0);
}

TEST(Registration, DoesNotDependOnTheOrderOfEitherCloud) {
  const Registration a = registered(organ(), seen());
  const Registration b = registered(organ(), {shuffled(seen().points, 3), {}});
  EXPECT_EQ(a.deformation->movedSurface(), b.deformation->movedSurface());

  const Points probe = bumpyEllipsoid(50, 4);
  const Registration c = registered({shuffled(organ().points, 5), {}}, seen());
  EXPECT_EQ(a.T_intraoperative_preoperative.matrix(), c.T_intraoperative_preoperative.matrix());
  EXPECT_TRUE(a.deformation->move(probe).isApprox(c.deformation->move(probe), 1e-6F));
}

TEST(Registration, CommonTranslationMovesTheResultAlong) {
  const Eigen::Vector3f shift(0.25F, -0.5F, 0.125F);
  PointCloud far_organ = organ(), far_seen = seen();
  far_organ.points.colwise() += shift;
  far_seen.points.colwise() += shift;
  const Points near = registered(organ(), seen()).deformation->movedSurface();
  const Points far = registered(far_organ, far_seen).deformation->movedSurface();
  // Coordinates a few times larger are a few bits coarser: 0.2 micrometres through the network.
  EXPECT_LT(((far.colwise() - shift) - near).cwiseAbs().maxCoeff(), 5e-6F);
}

TEST(Registration, GuessStandsForAMotionOfTheSeenCloud) {
  Eigen::Isometry3d guess(Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 1, 0).normalized()));
  guess.translation() << 0.3, 0.1, -0.2;
  // Taken whole: where a dense cloud is thinned, rounding may move a point to another voxel.
  const PointCloud sparse{seen().points.leftCols(1000), {}};
  PointCloud moved = sparse;
  moved.points = (guess * moved.points.cast<double>()).cast<float>();
  const Points direct = registered(organ(), sparse).deformation->movedSurface();
  const Points guessed = registered(organ(), moved, guess).deformation->movedSurface();
  const Points expected = (guess * direct.cast<double>()).cast<float>();
  EXPECT_LT((guessed - expected).cwiseAbs().maxCoeff(), 5e-6F);
}

TEST(Registration, HasTheSameBitsForAnyNumberOfThreadsAndAnyHistory) {
  Points first;
  for (const int threads : {1, 2, 3}) {
    RegistrationSettings settings = lenient();
    settings.threads = threads;
    Registrar registrar(weights(), settings);
    for (int repeat = 0; repeat < 2; ++repeat) {
      const auto registration =
          registrar.registerClouds(organ(), seen(), Eigen::Isometry3d::Identity());
      if (first.cols() == 0) first = registration.deformation->movedSurface();
      EXPECT_EQ(registration.deformation->movedSurface(), first);
    }
    registrar.registerClouds(seen(), organ(), Eigen::Isometry3d::Identity());  // another organ
    EXPECT_EQ(registrar.registerClouds(organ(), seen(), Eigen::Isometry3d::Identity())
                  .deformation->movedSurface(),
              first);
  }
}

TEST(Registration, RigidStageAloneDisplacesNothing) {
  RegistrationSettings settings = lenient();
  settings.stages = {Stage::kRigid};
  Registrar registrar(weights(), settings);
  const auto registration =
      registrar.registerClouds(organ(), seen(), Eigen::Isometry3d::Identity());
  EXPECT_EQ(registration.displacement.max, 0.0);
  EXPECT_EQ(registration.deformation->movedSurface(),
            registration.deformation->moveRigidly(organ().points));
}

TEST(Registration, DropsPointsThatAreNotFinite) {
  PointCloud dirty = seen();
  dirty.points.conservativeResize(3, dirty.size() + 2);
  dirty.points.rightCols(2).setConstant(std::numeric_limits<float>::quiet_NaN());
  dirty.points(1, dirty.size() - 1) = std::numeric_limits<float>::infinity();
  EXPECT_EQ(registered(organ(), dirty).deformation->movedSurface(),
            registered(organ(), seen()).deformation->movedSurface());
}

TEST(Registration, NamesTheCloudThatCannotBeRegistered) {
  const PointCloud empty{Points(3, 0), {}};
  EXPECT_EQ(inputFault(empty, seen()), "the pre-operative cloud is empty");
  EXPECT_EQ(inputFault(organ(), empty), "the intra-operative cloud is empty");
  PointCloud invalid = seen();
  invalid.points.setConstant(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(inputFault(organ(), invalid), "the intra-operative cloud is empty");
  PointCloud millimetres = seen();
  millimetres.points *= 1000.0F;
  EXPECT_NE(inputFault(organ(), millimetres).find("millimetres"), std::string::npos);
}

TEST(Registration, RefusesAGuessThatIsNotFinite) {
  Eigen::Isometry3d guess = Eigen::Isometry3d::Identity();
  guess.translation().y() = std::numeric_limits<double>::quiet_NaN();
  const Registration registration = registered(organ(), seen(), guess);
  EXPECT_EQ(registration.status, Status::kInvalidInput);
  EXPECT_NE(registration.message.find("guess"), std::string::npos);
}

TEST(Registration, RefusesWhatIsImplausibleButShowsIt) {
  RegistrationSettings settings = lenient();
  settings.plausibility.max_residual = 1e-6;
  Registrar registrar(weights(), settings);
  const auto registration =
      registrar.registerClouds(organ(), seen(), Eigen::Isometry3d::Identity());
  EXPECT_EQ(registration.status, Status::kRefused);
  EXPECT_NE(registration.message.find("surface residual"), std::string::npos);
  ASSERT_NE(registration.deformation, nullptr);
}

TEST(Registrar, RefusesSettingsOutOfRangeAndKeepsTheOldOnes) {
  RegistrationSettings bad = lenient();
  bad.network.rigid_iterations = 0;
  EXPECT_THROW(Registrar(weights(), bad), std::invalid_argument);
  Registrar registrar(weights(), lenient());
  EXPECT_THROW(registrar.setSettings(bad), std::invalid_argument);
  EXPECT_EQ(registrar.settings().network.rigid_iterations, 8);
  EXPECT_TRUE(registrar.registerClouds(organ(), seen(), Eigen::Isometry3d::Identity()).succeeded());
}

TEST(AlignCentroids, BringsTheCentroidsTogether) {
  const Eigen::Isometry3d start = alignCentroids(organ(), seen());
  const Eigen::Vector3d moved = start * centroid(organ().points).cast<double>();
  EXPECT_TRUE(moved.isApprox(centroid(seen().points).cast<double>(), 1e-6));
  EXPECT_TRUE(start.linear().isIdentity());
}

}  // namespace
}  // namespace unirit
