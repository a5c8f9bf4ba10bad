// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/errors.hpp"

#include <gtest/gtest.h>

#include "unirit/evaluation/baselines.hpp"

namespace unirit {
namespace {

Points columns(std::initializer_list<Eigen::Vector3f> points) {
  Points matrix(3, static_cast<Eigen::Index>(points.size()));
  Eigen::Index i = 0;
  for (const Eigen::Vector3f& point : points) matrix.col(i++) = point;
  return matrix;
}

/// Four corners of a square of side 2 that truly moved by (3, 4, 0), 5 in all; the target is
/// two of them.
RegistrationPair shiftedSquare() {
  RegistrationPair pair;
  pair.source = columns({{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0}});
  pair.truth = pair.source.colwise() + Eigen::Vector3f(3, 4, 0);
  pair.target = pair.truth.leftCols(2);
  pair.surface = pair.truth.colwise() + Eigen::Vector3f(0, 0, 2);
  pair.interior = columns({{0, 0, 0}, {0.5, 0, 0}});
  pair.interior_truth = pair.interior.colwise() + Eigen::Vector3f(3, 4, 0);
  pair.best_rigid.translation() << 3, 4, 0;
  return pair;
}

TEST(RegistrationErrors, OfTheUnmovedSourceAreThoseOfTheStart) {
  const RegistrationPair pair = shiftedSquare();
  const RegistrationErrors errors = registrationErrors(pair, Identity().registerPair(pair));
  EXPECT_DOUBLE_EQ(errors.before, 5.0);
  EXPECT_DOUBLE_EQ(errors.rmse, 5.0);
  EXPECT_DOUBLE_EQ(errors.p95, 5.0);
  EXPECT_DOUBLE_EQ(*errors.target, 5.0);
  EXPECT_DOUBLE_EQ(*errors.translation, 5.0);
  EXPECT_DOUBLE_EQ(*errors.rotation, 0.0);
  EXPECT_DOUBLE_EQ(*errors.pose, 5.0);
  EXPECT_FALSE(errors.worse());
  EXPECT_FALSE(errors.refused);
}

TEST(RegistrationErrors, OfTheOracleVanishWhereTheTruthIsRigid) {
  const RegistrationPair pair = shiftedSquare();
  const RegistrationErrors errors = registrationErrors(pair, BestRigidOracle().registerPair(pair));
  EXPECT_DOUBLE_EQ(errors.rmse, 0.0);
  EXPECT_DOUBLE_EQ(errors.best_rigid, 0.0);
  EXPECT_DOUBLE_EQ(*errors.target, 0.0);
  EXPECT_DOUBLE_EQ(*errors.surface, 2.0);  // its samples stand 2 above the truth
}

TEST(RegistrationErrors, ChamferCountsBothDirections) {
  // Source to target: 0, 0, 2, 2; back: 0, 0.
  const RegistrationPair pair = shiftedSquare();
  const RegistrationErrors errors = registrationErrors(pair, BestRigidOracle().registerPair(pair));
  EXPECT_DOUBLE_EQ(errors.chamfer, (1.0 + 0.0) / 2.0);
  EXPECT_DOUBLE_EQ(errors.chamfer_squared, 2.0 + 0.0);
}

TEST(RegistrationErrors, RootMeanSquareAndPercentileOfUnequalErrors) {
  const RegistrationPair pair = shiftedSquare();
  MethodResult result = BestRigidOracle().registerPair(pair);
  result.source.col(2) += Eigen::Vector3f(0, 0, 8);
  const RegistrationErrors errors = registrationErrors(pair, result);
  EXPECT_DOUBLE_EQ(errors.rmse, 4.0);  // sqrt(64 / 4)
  EXPECT_DOUBLE_EQ(errors.p95, 8.0);
}

TEST(RegistrationErrors, PoseIsComparedWithTheBestRigidFitAtTheCentroid) {
  const RegistrationPair pair = shiftedSquare();
  Eigen::Isometry3d pose(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
  pose.translation() << 3, 4, 1;
  const RegistrationErrors errors = registrationErrors(pair, movedRigidly(pair, pose));
  EXPECT_NEAR(*errors.rotation, 90.0, 1e-9);
  EXPECT_NEAR(*errors.translation, 1.0, 1e-9);
  EXPECT_NEAR(*errors.pose, std::sqrt(4.0 + 1.0), 1e-6);  // each corner one side on, and 1 up
}

TEST(RegistrationErrors, WorseMeansFartherThanTheStart) {
  const RegistrationPair pair = shiftedSquare();
  Eigen::Isometry3d away = Eigen::Isometry3d::Identity();
  away.translation() << -1, 0, 0;
  EXPECT_TRUE(registrationErrors(pair, movedRigidly(pair, away)).worse());
}

TEST(RegistrationErrors, WhatACaseOrMethodLacksIsNotMeasured) {
  RegistrationPair pair = shiftedSquare();
  pair.interior.resize(3, 0);
  pair.interior_truth.resize(3, 0);
  pair.surface.resize(3, 0);
  MethodResult result = Identity().registerPair(pair);
  result.pose.reset();
  const RegistrationErrors errors = registrationErrors(pair, result);
  EXPECT_FALSE(errors.surface || errors.target || errors.rotation || errors.translation ||
               errors.pose);
}

TEST(RegistrationErrors, RefusesResultsOfAnotherSize) {
  const RegistrationPair pair = shiftedSquare();
  MethodResult result = Identity().registerPair(pair);
  result.interior.resize(3, 1);
  EXPECT_THROW(registrationErrors(pair, result), std::invalid_argument);
  result = Identity().registerPair(pair);
  result.source.resize(3, 3);
  EXPECT_THROW(registrationErrors(pair, result), std::invalid_argument);
}

TEST(Unirit, ARefusedCaseStandsAtItsStart) {
  RegistrationPair pair = shiftedSquare();  // four points are fewer than a Registrar accepts
  pair.source_normals = Points::Constant(3, 4, 0.577F);
  Unirit method(std::make_shared<Weights>(randomWeights(NetworkSettings().pairing, 1)), {}, true);
  const MethodResult result = method.registerPair(pair);
  EXPECT_TRUE(result.refused);
  // Centroids brought together: the target's is at (3, 5, 0).
  EXPECT_TRUE(result.source.isApprox(pair.source.colwise() + Eigen::Vector3f(3, 5, 0), 1e-5F));
  EXPECT_NEAR(registrationErrors(pair, result).rmse, 1.0, 1e-5);
  EXPECT_TRUE(registrationErrors(pair, result).refused);
}

}  // namespace
}  // namespace unirit
