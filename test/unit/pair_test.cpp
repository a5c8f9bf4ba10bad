// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/pair.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"
#include "unirit/metrics.hpp"

namespace unirit {
namespace {

/// A box cut finely enough to be deformed: every face of it split into a grid.
Surface organ() {
  Surface mesh = test::box({0.2F, 0.12F, 0.08F});
  for (int round = 0; round < 3; ++round) {  // each triangle into four
    Surface finer;
    const Eigen::Index faces = mesh.faces.cols();
    finer.vertices.points.resize(3, 12 * faces);
    finer.faces.resize(3, 4 * faces);
    for (Eigen::Index f = 0; f < faces; ++f) {
      const Eigen::Matrix3f c =
          select(mesh.vertices.points, {mesh.faces(0, f), mesh.faces(1, f), mesh.faces(2, f)});
      const Eigen::Vector3f ab = (c.col(0) + c.col(1)) / 2, bc = (c.col(1) + c.col(2)) / 2,
                            ca = (c.col(2) + c.col(0)) / 2;
      finer.vertices.points.middleCols(12 * f, 12) << c.col(0), ab, ca, ab, c.col(1), bc, ca, bc,
          c.col(2), ab, bc, ca;
    }
    for (int i = 0; i < finer.faces.size(); ++i) finer.faces.data()[i] = i;
    mesh = finer;
  }
  return mesh;
}

/// Two such boxes, one beside the other.
Surface twoBoxes() {
  Surface two = organ();
  const Points near = two.vertices.points;
  const Eigen::Matrix3Xi faces = two.faces;
  two.vertices.points.resize(3, 2 * near.cols());
  two.vertices.points << near, near.colwise() + Eigen::Vector3f(0.0F, 0.0F, 0.16F);
  two.faces.resize(3, 2 * faces.cols());
  two.faces << faces, faces.array() + static_cast<int>(near.cols());
  return two;
}

/// Share of the target's points that lie behind the true surface, seen from the viewpoint.
double hiddenShare(const RegistrationPair& pair) {
  const Points surface = pair.surface.leftCols(4000).colwise() - *pair.viewpoint;
  const Points rays = surface.colwise().normalized();
  int hidden = 0;
  for (Eigen::Index i = 0; i < pair.target.cols(); ++i) {
    const Eigen::Vector3f point = pair.target.col(i) - *pair.viewpoint;
    const Eigen::RowVectorXf along = point.transpose() * rays;  // of the rays to the surface
    for (Eigen::Index k = 0; k < surface.cols(); ++k) {
      const bool same_ray = (point - along[k] * rays.col(k)).norm() < 0.003F;
      if (same_ray && surface.col(k).norm() < along[k] - 0.03F) {
        ++hidden;
        break;
      }
    }
  }
  return static_cast<double>(hidden) / static_cast<double>(pair.target.cols());
}

TEST(Pair, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const Surface mesh = organ();
  for (const Protocol protocol : allProtocols()) {
    const RegistrationPair a = makePair(mesh, protocol, 128, 1),
                           b = makePair(mesh, protocol, 128, 1);
    EXPECT_EQ(a.source, b.source);
    EXPECT_EQ(a.target, b.target);
    EXPECT_EQ(a.truth, b.truth);
    EXPECT_NE(a.target, makePair(mesh, protocol, 128, 2).target) << toString(protocol);
  }
}

TEST(Pair, DeformsByTheShareOfTheExtentThatTheProtocolsName) {
  const Surface mesh = organ();
  double sum = 0.0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const RegistrationPair pair = makePair(mesh, Protocol::kResampled, 1024, seed);
    sum += rootMeanSquareDistance(pair.source, pair.truth);
  }
  EXPECT_NEAR(sum / 20.0, 0.075 * extent(mesh.vertices.points), 0.001);
}

TEST(Pair, TargetsOfPairedAndPermutedAreTheTruth) {
  const Surface mesh = organ();
  const RegistrationPair paired = makePair(mesh, Protocol::kPaired, 200, 3);
  EXPECT_EQ(paired.target, paired.truth);
  const RegistrationPair permuted = makePair(mesh, Protocol::kPermuted, 200, 3);
  EXPECT_NE(permuted.target, permuted.truth);
  EXPECT_EQ(nearestDistances(permuted.target, permuted.truth).maxCoeff(), 0.0F);
}

TEST(Pair, ResampledTargetsLieOnTheDeformedSurfaceButAreOtherPoints) {
  const RegistrationPair pair = makePair(organ(), Protocol::kResampled, 4000, 4);
  const Eigen::RowVectorXf distances = nearestDistances(pair.target, pair.truth);
  EXPECT_LT(distances.mean(), 0.004F);
  EXPECT_GT(distances.mean(), 0.0005F);
}

TEST(Pair, PartialTargetsFaceTheCamera) {
  const RegistrationPair pair = makePair(organ(), Protocol::kPartial, 1024, 5);
  ASSERT_TRUE(pair.viewpoint.has_value());
  const double near = (pair.target.colwise() - *pair.viewpoint).colwise().norm().mean();
  const double all = (pair.truth.colwise() - *pair.viewpoint).colwise().norm().mean();
  EXPECT_LT(near, all - 0.01);
  EXPECT_FALSE(makePair(organ(), Protocol::kCaseB, 64, 5).viewpoint.has_value());
}

TEST(Pair, CameraTargetsAreWhatNothingHides) {
  const Surface mesh = twoBoxes();
  double camera = 0.0, partial = 0.0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    const RegistrationPair seen = makePair(mesh, Protocol::kCamera, 400, seed);
    ASSERT_TRUE(seen.viewpoint.has_value());
    const double hidden = hiddenShare(seen);
    EXPECT_LT(hidden, 0.05) << seed;  // as many are outliers
    EXPECT_LT(nearestDistances(seen.target, seen.surface).mean(), 0.006F);
    camera += hidden;
    partial += hiddenShare(makePair(mesh, Protocol::kPartial, 400, seed));
  }
  EXPECT_LT(camera, 0.2 * partial);
}

TEST(Pair, CaseBRotatesAndShiftsWithinItsBounds) {
  const Surface mesh = organ();
  const double half = extent(mesh.vertices.points) / 2.0;
  double largest_angle = 0.0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const RegistrationPair pair = makePair(mesh, Protocol::kCaseB, 256, seed);
    const double angle = Eigen::AngleAxisd(pair.best_rigid.linear()).angle();
    largest_angle = std::max(largest_angle, angle);
    // The deformation itself has a rigid part of its own, hence the margins.
    EXPECT_LT(angle, (45.0 + 15.0) * M_PI / 180.0);
    EXPECT_LT(pair.best_rigid.translation().cwiseAbs().maxCoeff(), 0.2 * half + 0.03);
  }
  EXPECT_GT(largest_angle, 25.0 * M_PI / 180.0);
}

TEST(Pair, OffsetMovesTheTargetHalfAMetreAway) {
  const RegistrationPair pair = makePair(organ(), Protocol::kOffset, 256, 6);
  EXPECT_NEAR((centroid(pair.target) - centroid(pair.source)).norm(), 0.5F, 0.06F);
}

TEST(Pair, InteriorPointsLieInsideAndMoveWithTheirOrgan) {
  const Surface mesh = organ();  // a box of 0.2 x 0.12 x 0.08 m
  const RegistrationPair pair = makePair(mesh, Protocol::kCaseB, 256, 8);
  ASSERT_EQ(pair.interior.cols(), 200);
  const Eigen::Array3f half(0.1F, 0.06F, 0.04F);
  for (Eigen::Index i = 0; i < pair.interior.cols(); ++i) {
    EXPECT_TRUE((pair.interior.col(i).array().abs() < 0.86F * half).all());
    EXPECT_TRUE((pair.interior.col(i).array().abs() > 0.29F * half).any());
  }
  // With the true rigid part taken away, what is left is the deformation alone.
  const Points rigid = (pair.best_rigid * pair.interior.cast<double>()).cast<float>();
  const double left = rootMeanSquareDistance(rigid, pair.interior_truth);
  EXPECT_GT(left, 0.001);
  EXPECT_LT(left, 0.075 * extent(mesh.vertices.points));
  EXPECT_EQ(makePair(mesh, Protocol::kCaseB, 256, 8).interior_truth, pair.interior_truth);
}

TEST(Pair, SurfaceSamplesLieWhereTheSourceTrulyWent) {
  const Surface mesh = organ();
  for (const Protocol protocol : {Protocol::kResampled, Protocol::kIntraop, Protocol::kOffset}) {
    const RegistrationPair pair = makePair(mesh, protocol, 1024, 9);
    ASSERT_EQ(pair.surface.cols(), 20000);
    const Eigen::RowVectorXf distances = nearestDistances(pair.truth, pair.surface);
    EXPECT_LT(distances.mean(), 0.0015F) << toString(protocol);
  }
}

TEST(Pair, SurfaceSamplesAreMadeOnlyWhereAskedFor) {
  const DeformedOrgan deformed(organ(), 10, 2000);
  const View view = viewOf(Protocol::kCaseB);
  EXPECT_EQ(deformed.pair(view, 256, 1).surface.cols(), 0);
  EXPECT_EQ(deformed.pair(view, 256, 1, 2000).surface.cols(), 2000);
  EXPECT_THROW(deformed.pair(view, 256, 1, 2001), std::invalid_argument);
}

TEST(Pair, TheSameSeedGivesEveryProtocolTheSameSourceAndDeformation) {
  const Surface mesh = organ();
  const RegistrationPair paired = makePair(mesh, Protocol::kPaired, 256, 11);
  for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
    const RegistrationPair other = makePair(mesh, protocol, 256, 11);
    EXPECT_EQ(other.source, paired.source) << toString(protocol);
    EXPECT_EQ(other.truth, paired.truth) << toString(protocol);
  }
}

TEST(Pair, RefusesMorePointsThanTheViewHolds) {
  EXPECT_THROW(makePair(organ(), Protocol::kPartial, 20000, 7), std::invalid_argument);
}

TEST(Protocols, NamesRoundTripAndUnknownOnesAreRefused) {
  for (const Protocol protocol : allProtocols()) {
    EXPECT_EQ(protocolFromString(toString(protocol)), protocol);
  }
  EXPECT_THROW(protocolFromString("caseA"), std::invalid_argument);
}

TEST(BestRigidFit, FindsAKnownPose) {
  const Points from = test::bumpyEllipsoid(100, 8);
  Eigen::Isometry3d pose(Eigen::AngleAxisd(2.0, Eigen::Vector3d(3, 1, 2).normalized()));
  pose.translation() << 1.0, 2.0, 3.0;
  const Points to = (pose * from.cast<double>()).cast<float>();
  EXPECT_TRUE(bestRigidFit(from, to).isApprox(pose, 1e-5));
  EXPECT_THROW(bestRigidFit(from, Points(3, 5)), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
