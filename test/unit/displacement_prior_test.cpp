// SPDX-License-Identifier: BSD-3-Clause
#include "refinement/displacement_prior.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"

namespace unirit {
namespace {

constexpr double kLength = 0.5, kAmplitude = 0.1;

Points organ(Eigen::Index count = 600) { return 10.0F * test::bumpyEllipsoid(count, 1); }

/// Other points of the surface.
Points between() { return 10.0F * test::bumpyEllipsoid(60, 2); }

Points inside() { return 6.0F * test::bumpyEllipsoid(60, 3); }

Points probes() {
  Points probes(3, 120);
  probes << between(), inside();
  return probes;
}

Eigen::MatrixXd covariance(const DisplacementPrior& prior, const Points& points) {
  const Eigen::MatrixXd functions = prior.functions(points).cast<double>();
  return functions.transpose() * functions;
}

/// As displacement_prior.hpp has it.
Eigen::MatrixXd expectedCovariance(const Points& points) {
  Eigen::MatrixXd expected(points.cols(), points.cols());
  for (Eigen::Index a = 0; a < points.cols(); ++a) {
    for (Eigen::Index b = 0; b < points.cols(); ++b) {
      const auto squared = static_cast<double>((points.col(a) - points.col(b)).squaredNorm());
      expected(a, b) = kAmplitude * kAmplitude * std::exp(-squared / (2.0 * kLength * kLength));
    }
  }
  return expected;
}

/// Largest error of the covariance over the variance.
double error(int rank, const Points& points) {
  const DisplacementPrior prior(organ(), kLength, kAmplitude, rank);
  return (covariance(prior, points) - expectedCovariance(points)).cwiseAbs().maxCoeff() /
         (kAmplitude * kAmplitude);
}

Eigen::Matrix3Xf someCoefficients(Eigen::Index rank) {
  Random random(4);
  return Eigen::Matrix3Xf::NullaryExpr(3, rank,
                                       [&] { return static_cast<float>(random.normal()); });
}

TEST(DisplacementPrior, HasTheCovarianceItNames) {
  EXPECT_LT(error(128, between()), 0.001);
  EXPECT_LT(error(48, between()), 0.01);
  EXPECT_GT(error(8, between()), 0.1);  // too few functions for this length
  EXPECT_LT(error(48, inside()), 0.1);  // known from the surface alone
  const DisplacementPrior prior(organ(), kLength, kAmplitude, 48);
  EXPECT_FLOAT_EQ(prior.variance(), 0.01F);
}

TEST(DisplacementPrior, NeverVariesMoreThanItsVariance) {
  for (const int rank : {8, 48, 128}) {
    const DisplacementPrior prior(organ(), kLength, kAmplitude, rank);
    const Eigen::RowVectorXf variances = prior.functions(probes()).colwise().squaredNorm();
    EXPECT_LT(variances.maxCoeff(), prior.variance() * 1.001F) << rank;
  }
}

TEST(DisplacementPrior, KeepsTheRankAskedForWhereTheSurfaceHasThePoints) {
  EXPECT_EQ(DisplacementPrior(organ(), kLength, kAmplitude, 48).rank(), 48);
  EXPECT_EQ(DisplacementPrior(organ(), kLength, kAmplitude, 500).rank(), 128);
  EXPECT_EQ(DisplacementPrior(organ(20), kLength, kAmplitude, 48).rank(), 20);
}

TEST(DisplacementPrior, DisplacementsAreTheFunctionsWeighted) {
  const DisplacementPrior prior(organ(), kLength, kAmplitude, 48);
  const Eigen::Matrix3Xf coefficients = someCoefficients(48);
  const Points many = 10.0F * test::bumpyEllipsoid(2500, 5);  // several blocks and a rest
  const Points displacements = prior.displacements(many, coefficients);
  const Eigen::Matrix3Xd expected =
      coefficients.cast<double>() * prior.functions(many).cast<double>();
  EXPECT_LT((displacements.cast<double>() - expected).cwiseAbs().maxCoeff(), 1e-4 * kAmplitude);
  EXPECT_GT(displacements.cwiseAbs().maxCoeff(), static_cast<float>(kAmplitude));
}

TEST(DisplacementPrior, GradientsAreTheDifferencesOfDisplacements) {
  const DisplacementPrior prior(organ(), kLength, kAmplitude, 48);
  const Eigen::Matrix3Xf coefficients = someCoefficients(48);
  const Points points = probes();
  const auto gradients = prior.gradients(points, coefficients);
  ASSERT_EQ(gradients.size(), 120U);
  constexpr float kStep = 1e-2F;
  for (int axis = 0; axis < 3; ++axis) {
    const auto movedBy = [&](float step) {
      Points shifted = points;
      shifted.row(axis).array() += step;
      return prior.displacements(shifted, coefficients);
    };
    const Points differences = (movedBy(kStep) - movedBy(-kStep)) / (2.0F * kStep);
    for (std::size_t i = 0; i < gradients.size(); ++i) {
      const Eigen::Vector3f column = gradients[i].col(axis);
      EXPECT_LT((column - differences.col(static_cast<Eigen::Index>(i))).norm(), 2e-3F);
      EXPECT_LT(column.norm(), 3.0F);
    }
  }
}

/// Two displacements differ no more than a process of this covariance allows:
/// |f(p) - f(q)|^2 <= 2 amplitude^2 (1 - exp(-|p - q|^2 / 2 length^2)).
TEST(DisplacementPrior, IsSmoothFromTheSurfaceThroughTheInside) {
  const DisplacementPrior prior(organ(), kLength, kAmplitude, 48);
  const Eigen::Matrix3Xf coefficients = someCoefficients(48);
  Points line(3, 1001);  // from far outside through the organ
  for (int k = 0; k <= 1000; ++k) line.col(k) << static_cast<float>(k) * 0.004F - 2.0F, 0.1F, 0.05F;
  const Points displacements = prior.displacements(line, coefficients);
  ASSERT_TRUE(displacements.allFinite());
  const double squared = 0.004 * 0.004;
  const double bound = kAmplitude *
                       std::sqrt(2.0 * (1.0 - std::exp(-squared / (2.0 * kLength * kLength)))) *
                       static_cast<double>(coefficients.rowwise().norm().maxCoeff());
  for (int k = 1; k <= 1000; ++k) {
    const Eigen::Vector3f step = displacements.col(k) - displacements.col(k - 1);
    EXPECT_LT(static_cast<double>(step.cwiseAbs().maxCoeff()), bound) << k;
  }
}

TEST(DisplacementPrior, LeavesFarAwayPointsWhereTheyAre) {
  const DisplacementPrior prior(organ(), kLength, kAmplitude, 48);
  const Points far = Eigen::Vector3f(20.0F, 0.0F, 0.0F);
  EXPECT_LT(prior.displacements(far, someCoefficients(48)).norm(), 1e-30F);
}

TEST(DisplacementPrior, DoesNotDependOnTheOrderOfTheSurface) {
  const DisplacementPrior a(organ(), kLength, kAmplitude, 48),
      b(test::shuffled(organ(), 6), kLength, kAmplitude, 48);
  EXPECT_LT((covariance(a, probes()) - covariance(b, probes())).cwiseAbs().maxCoeff(),
            1e-4 * kAmplitude * kAmplitude);
}

}  // namespace
}  // namespace unirit
