// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/sampling.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"
#include "unirit/metrics.hpp"

namespace unirit {
namespace {

using test::box;
using test::bumpyEllipsoid;
using test::shuffled;

TEST(SampleEvenly, ChoosesTheSamePointsInTheSameSequenceWhateverTheOrderOfTheCloud) {
  for (const Eigen::Index count : {300, 5000, 60000}) {  // taken whole, sampled, thinned first
    const Points points = bumpyEllipsoid(count, 1);
    const Points other = shuffled(points, 2);
    ASSERT_NE(points, other);
    EXPECT_EQ(select(points, sampleEvenly(points, 1024)), select(other, sampleEvenly(other, 1024)));
  }
}

TEST(SampleEvenly, KeepsTheWholeOfASmallCloud) {
  const Points points = bumpyEllipsoid(500, 3);
  EXPECT_EQ(sampleEvenly(points, 500).size(), 500U);
  EXPECT_EQ(sampleEvenly(points, 1024).size(), 500U);
}

TEST(SampleEvenly, LeavesNoPartOfADenseCloudUncovered) {
  const Points points = bumpyEllipsoid(40000, 4);
  const Points sampled = select(points, sampleEvenly(points, 1024));
  ASSERT_EQ(sampled.cols(), 1024);
  // 1024 discs of this radius have about three times the surface's area of 0.05 square metres.
  EXPECT_LT(nearestDistances(points, sampled).maxCoeff(), 0.007F);
}

TEST(SampleEvenly, CopesWithRepeatedPoints) {
  const Points same = Points::Constant(3, 2000, 0.5F);
  EXPECT_EQ(sampleEvenly(same, 100).size(), 100U);
}

TEST(SampleEvenly, RefusesToSampleNoPoint) {
  EXPECT_THROW(sampleEvenly(bumpyEllipsoid(10, 1), 0), std::invalid_argument);
}

TEST(DrawByLot, DrawsTheSamePointsWhateverTheOrderOfTheCloud) {
  const Points points = bumpyEllipsoid(20000, 6);
  Points drawn = select(points, drawByLot(points, 3000));
  const Points other = shuffled(points, 7);
  const Points drawn_of_other = select(other, drawByLot(other, 3000));
  EXPECT_NE(drawn, drawn_of_other);  // they stand in the cloud's order
  EXPECT_EQ(nearestDistances(drawn, drawn_of_other).maxCoeff(), 0.0F);
  EXPECT_EQ(drawn.cols(), drawn_of_other.cols());
}

TEST(DrawByLot, DrawsAboutTheShareAskedForEverywhere) {
  const Points points = bumpyEllipsoid(20000, 8);
  const Points drawn = select(points, drawByLot(points, 5000));
  EXPECT_NEAR(static_cast<double>(drawn.cols()), 5000.0, 250.0);  // 4 standard deviations
  for (int axis = 0; axis < 3; ++axis) {
    const auto above = [&](const Points& cloud) {
      return (cloud.row(axis).array() > 0.0F).cast<double>().mean();
    };
    EXPECT_NEAR(above(drawn), above(points), 0.03);
  }
}

TEST(DrawByLot, KeepsTheWholeOfASmallCloudAndRefusesToDrawNoPoint) {
  const Points points = bumpyEllipsoid(500, 9);
  EXPECT_EQ(select(points, drawByLot(points, 500)), points);
  EXPECT_THROW(drawByLot(points, 0), std::invalid_argument);
}

TEST(SampleByArea, PutsPointsOnTheSurfaceInProportionToArea) {
  const Surface mesh = box({0.1F, 0.2F, 0.4F});
  const PointCloud samples = sampleByArea(mesh, 20000, 5);
  Eigen::Index on_bottom = 0;
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3f p = samples.points.col(i);
    const float inside = std::min({p[0], p[1], p[2], 0.1F - p[0], 0.2F - p[1], 0.4F - p[2]});
    ASSERT_NEAR(inside, 0.0F, 1e-6F);
    if (p[2] < 1e-6F) ++on_bottom;
  }
  const double share = 0.1 * 0.2 / (2 * (0.1 * 0.2 + 0.1 * 0.4 + 0.2 * 0.4));
  EXPECT_NEAR(static_cast<double>(on_bottom) / 20000.0, share, 0.01);
}

TEST(SampleByArea, GivesNormalsThatPointOutwards) {
  const Surface mesh = box({0.1F, 0.2F, 0.4F});
  const PointCloud samples = sampleByArea(mesh, 1000, 6);
  const Eigen::Vector3f centre(0.05F, 0.1F, 0.2F);
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    EXPECT_GT(samples.normals.col(i).dot(samples.points.col(i) - centre), 0.0F);
    EXPECT_NEAR(samples.normals.col(i).norm(), 1.0F, 1e-5F);
  }
}

TEST(SampleByArea, IsDeterministicForASeed) {
  const Surface mesh = box({0.1F, 0.2F, 0.4F});
  EXPECT_EQ(sampleByArea(mesh, 50, 7).points, sampleByArea(mesh, 50, 7).points);
  EXPECT_NE(sampleByArea(mesh, 50, 7).points, sampleByArea(mesh, 50, 8).points);
}

TEST(SampleByArea, RefusesMeshesWithoutArea) {
  Surface cloud;
  cloud.vertices.points = bumpyEllipsoid(10, 1);
  EXPECT_THROW(sampleByArea(cloud, 10, 1), std::invalid_argument);
  Surface flat = box({0.0F, 0.0F, 0.0F});
  EXPECT_THROW(sampleByArea(flat, 10, 1), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
