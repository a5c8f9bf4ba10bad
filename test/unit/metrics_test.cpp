// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/metrics.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"

namespace unirit {
namespace {

/// A flat 11 x 11 grid with 10 mm between points.
Points grid() {
  Points points(3, 121);
  for (int i = 0; i < 121; ++i) {
    points.col(i) << 0.01F * static_cast<float>(i % 11), 0.01F * static_cast<float>(i / 11), 0.0F;
  }
  return points;
}

TEST(RootMeanSquareDistance, EqualsTheHandComputedValue) {
  Points a = Points::Zero(3, 2), b = Points::Zero(3, 2);
  b(0, 0) = 3.0F;
  b(1, 1) = 4.0F;
  EXPECT_DOUBLE_EQ(rootMeanSquareDistance(a, b), std::sqrt(12.5));
}

TEST(RootMeanSquareDistance, RefusesCloudsOfDifferentOrNoSize) {
  EXPECT_THROW(rootMeanSquareDistance(Points(3, 2), Points(3, 3)), std::invalid_argument);
  EXPECT_THROW(rootMeanSquareDistance(Points(3, 0), Points(3, 0)), std::invalid_argument);
}

TEST(NearestDistances, AgreeWithAFullSearch) {
  const Points from = test::bumpyEllipsoid(200, 1);
  for (const Eigen::Index count : {300, 3000}) {
    const Points to = test::bumpyEllipsoid(count, 2);
    const Eigen::RowVectorXf distances = nearestDistances(from, to);
    for (Eigen::Index i = 0; i < from.cols(); ++i) {
      EXPECT_FLOAT_EQ(distances[i], (to.colwise() - from.col(i)).colwise().norm().minCoeff());
    }
  }
  EXPECT_THROW(nearestDistances(from, Points(3, 0)), std::invalid_argument);
  EXPECT_EQ(nearestDistances(Points(3, 0), from).size(), 0);
}

TEST(SurfaceResidual, MeasuresALiftedHalfOfAGrid) {
  Points seen = grid().leftCols(66);  // 6 of 11 rows
  seen.row(2).array() += 0.002F;
  const SurfaceResidual residual = surfaceResidual(grid(), seen, 0.003);
  EXPECT_NEAR(residual.rms, 0.002, 1e-7);
  EXPECT_NEAR(residual.median, 0.002, 1e-7);
  EXPECT_NEAR(residual.p95, 0.002, 1e-7);
  EXPECT_DOUBLE_EQ(residual.inlier_fraction, 1.0);
  EXPECT_NEAR(residual.coverage, 66.0 / 121.0, 1e-12);
  EXPECT_DOUBLE_EQ(surfaceResidual(grid(), seen, 0.001).inlier_fraction, 0.0);
}

TEST(SurfaceResidual, OfLargeCloudsIsThatOfAllTheirPoints) {
  const Points surface = test::bumpyEllipsoid(70000, 3);
  Points seen = test::bumpyEllipsoid(50000, 4);
  Random random(5);
  for (Eigen::Index k = 0; k < seen.size(); ++k) {
    seen.data()[k] += static_cast<float>(0.003 * random.normal());
  }
  const Eigen::RowVectorXf distances = nearestDistances(seen, surface);
  const Eigen::RowVectorXf covered = nearestDistances(surface, seen.leftCols(10000));
  const float tolerance = 0.003F;
  const SurfaceResidual residual = surfaceResidual(surface, seen, tolerance);
  const std::vector<float> all(distances.data(), distances.data() + distances.size());
  EXPECT_NEAR(residual.median, quantile(all, 0.5), 1e-4);
  EXPECT_NEAR(residual.p95, quantile(all, 0.95), 3e-4);
  EXPECT_NEAR(residual.inlier_fraction, (distances.array() <= tolerance).cast<double>().mean(),
              0.015);
  EXPECT_NEAR(surfaceResidual(surface, seen.leftCols(10000), tolerance).coverage,
              (covered.array() <= tolerance).cast<double>().mean(), 0.015);
}

using Jacobians = std::vector<Eigen::Matrix3f>;

/// Of `count` points, stretched along the axes.
Jacobians stretched(std::size_t count, float x, float y, float z) {
  return Jacobians(count, Eigen::Vector3f(x, y, z).asDiagonal().toDenseMatrix());
}

TEST(DisplacementStatistics, OfAUniformShiftAreItsLengthWithoutFolds) {
  Points shift = Points::Zero(3, 121);
  shift.row(0).setConstant(0.003F);
  shift.row(1).setConstant(0.004F);
  const DisplacementStatistics statistics =
      displacementStatistics(shift, stretched(121, 1.0F, 1.0F, 1.0F));
  EXPECT_NEAR(statistics.rms, 0.005, 1e-7);
  EXPECT_NEAR(statistics.p95, 0.005, 1e-7);
  EXPECT_NEAR(statistics.max, 0.005, 1e-7);
  EXPECT_DOUBLE_EQ(statistics.folded_fraction, 0.0);
  EXPECT_NEAR(statistics.stretch, 1.0, 1e-6);
  EXPECT_NEAR(statistics.compression, 1.0, 1e-6);
}

TEST(DisplacementStatistics, CountFoldsAndMeasureStretchInAnyOrientation) {
  Jacobians jacobians = stretched(75, 1.0F, 1.4F, 0.6F);
  const Jacobians mirrored = stretched(25, 1.0F, -0.9F, 1.1F);
  jacobians.insert(jacobians.end(), mirrored.begin(), mirrored.end());
  const Eigen::Matrix3f turn =
      Eigen::AngleAxisf(1.0F, Eigen::Vector3f(1.0F, 2.0F, 3.0F).normalized()).toRotationMatrix();
  for (Eigen::Matrix3f& jacobian : jacobians) jacobian = turn * jacobian;
  const DisplacementStatistics statistics = displacementStatistics(Points::Zero(3, 5), jacobians);
  EXPECT_DOUBLE_EQ(statistics.folded_fraction, 0.25);
  EXPECT_NEAR(statistics.stretch, 1.4, 1e-5);
  EXPECT_NEAR(statistics.compression, 0.6, 1e-5);
}

TEST(DisplacementStatistics, NeedDisplacementsAndJacobians) {
  EXPECT_THROW(displacementStatistics(Points(3, 0), stretched(1, 1.0F, 1.0F, 1.0F)),
               std::invalid_argument);
  EXPECT_THROW(displacementStatistics(Points::Zero(3, 5), {}), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
