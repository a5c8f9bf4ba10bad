// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/gaussian_mixture.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

#include "shapes.hpp"
#include "unirit/evaluation/divergence_table.hpp"

namespace unirit {
namespace {

constexpr double kLogOfTwoPi = 1.8378770664093453;

/// Six points with mean zero and covariance one.
Points octahedron() {
  Points points(3, 6);
  points << Eigen::Matrix3f::Identity(), -Eigen::Matrix3f::Identity();
  return std::sqrt(3.0F) * points;
}

Points normalCloud(Eigen::Index count, const Eigen::Vector3f& mean, float deviation,
                   std::uint64_t seed) {
  Random random(seed);
  return Points::NullaryExpr(3, count,
                             [&] { return deviation * static_cast<float>(random.normal()); })
             .colwise() +
         mean;
}

TEST(GaussianMixture, OfOneComponentIsTheNormalDistributionWorkedOutByHand) {
  const GaussianMixture mixture(octahedron(), 1, 1);
  Points places(3, 2);
  places << 0, 1, 0, 2, 0, 2;  // the origin, and (1, 2, 2) at distance 3
  const Eigen::VectorXd logs = mixture.logDensities(places);
  EXPECT_NEAR(logs[0], -1.5 * kLogOfTwoPi, 1e-4);
  EXPECT_NEAR(logs[1], -1.5 * kLogOfTwoPi - 4.5, 1e-3);
}

TEST(GaussianMixture, FindsTwoClustersAndTheirWeights) {
  Points cloud(3, 400);
  cloud << normalCloud(100, {0, 0, 0}, 0.1F, 1), normalCloud(300, {10, 0, 0}, 0.2F, 2);
  const GaussianMixture mixture(cloud, 2, 3);
  Points centres(3, 2);
  centres << 0, 10, 0, 0, 0, 0;
  const Eigen::VectorXd logs = mixture.logDensities(centres);
  EXPECT_NEAR(logs[0], std::log(0.25) - 1.5 * kLogOfTwoPi - 3.0 * std::log(0.1), 0.3);
  EXPECT_NEAR(logs[1], std::log(0.75) - 1.5 * kLogOfTwoPi - 3.0 * std::log(0.2), 0.2);
}

TEST(GaussianMixture, DescribesACloudBetterWithMoreComponents) {
  const Points cloud = test::bumpyEllipsoid(600, 4);
  double before = -1e9;
  for (const int components : {1, 4, 16}) {
    const double mean = GaussianMixture(cloud, components, 5).logDensities(cloud).mean();
    EXPECT_GT(mean, before + 0.1) << components;
    before = mean;
  }
}

TEST(GaussianMixture, StaysFiniteFarAwayAndOnFlatClouds) {
  Points flat = normalCloud(200, {0, 0, 0}, 1.0F, 6);
  flat.row(2).setZero();
  const GaussianMixture mixture(flat, 4, 7);
  Points far(3, 1);
  far << 1e4F, 1e4F, 1e4F;  // every density underflows
  EXPECT_TRUE(mixture.logDensities(far).allFinite());
  EXPECT_LT(mixture.logDensities(far)[0], -1e6);
  EXPECT_TRUE(mixture.logDensities(flat).allFinite());
}

TEST(GaussianMixture, IsTheSameForTheSameSeedAndRefusesWhatItCannotFit) {
  const Points cloud = test::bumpyEllipsoid(300, 8);
  EXPECT_EQ(GaussianMixture(cloud, 8, 9).logDensities(cloud),
            GaussianMixture(cloud, 8, 9).logDensities(cloud));
  EXPECT_THROW(GaussianMixture(cloud, 0, 1), std::invalid_argument);
  EXPECT_THROW(GaussianMixture(cloud.leftCols(3), 4, 1), std::invalid_argument);
  EXPECT_THROW(GaussianMixture(Points::Ones(3, 50), 2, 1), std::invalid_argument);
}

TEST(MixtureDivergence, OfTwoNormalDistributionsIsHalfTheSquaredDistance) {
  const Points x = octahedron();
  const Points y = x.colwise() + Eigen::Vector3f(1, 2, 2);
  EXPECT_NEAR(mixtureDivergence(x, y, 1, 1), 4.5, 1e-3);
}

TEST(MixtureDivergence, OfTwoSizesIsThatWorkedOutByHand) {
  // Variances 1 and 4: (tr(1/4) + tr(4) - 6) / 4 = (0.75 + 12 - 6) / 4
  EXPECT_NEAR(mixtureDivergence(octahedron(), 2.0F * octahedron(), 1, 1), 1.6875, 1e-3);
}

TEST(MixtureDivergence, IsSymmetricZeroForEqualCloudsAndDoesNotDependOnTheUnit) {
  const Points x = test::bumpyEllipsoid(400, 1);
  const Points y = (x.array() * 1.2F).matrix().colwise() + Eigen::Vector3f(0.01F, 0, 0);
  EXPECT_EQ(mixtureDivergence(x, x, 8, 2), 0.0);
  EXPECT_DOUBLE_EQ(mixtureDivergence(x, y, 8, 2), mixtureDivergence(y, x, 8, 2));
  EXPECT_NEAR(mixtureDivergence(1000.0F * x, 1000.0F * y, 8, 2), mixtureDivergence(x, y, 8, 2),
              0.02);
  EXPECT_GT(mixtureDivergence(x, y, 8, 2), 0.1);
}

TEST(DivergenceTable, IsSymmetricAndTellsShapesApart) {
  std::vector<LabelledCloud> clouds;
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    clouds.push_back({"egg", test::bumpyEllipsoid(300, seed)});
    clouds.push_back({"ball", normalCloud(300, {1, 2, 3}, 0.1F, 10 + seed)});
  }
  clouds.push_back({"single", test::bumpyEllipsoid(300, 20)});
  DivergenceSettings settings;
  settings.components = 4;
  const DivergenceTable table = divergenceTable(clouds, settings);
  EXPECT_EQ(table.labels, (std::vector<std::string>{"ball", "egg", "single"}));
  EXPECT_EQ(table.mean(0, 1), table.mean(1, 0));
  EXPECT_GT(table.mean(0, 1), 2.0 * table.mean(1, 1));
  EXPECT_TRUE(std::isnan(table.mean(2, 2)));
  EXPECT_GE(table.spread(0, 1), 0.0);
  const std::string text = toMarkdown(table);
  EXPECT_EQ(text.rfind("| L_mc | ball | egg | single |\n|---|---|---|---|\n| ball |", 0), 0U)
      << text;
  EXPECT_NE(text.find("no two surfaces |\n"), std::string::npos) << text;
}

}  // namespace
}  // namespace unirit
