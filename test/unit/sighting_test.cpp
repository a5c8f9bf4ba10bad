// SPDX-License-Identifier: BSD-3-Clause
#include "refinement/sighting.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "unirit/evaluation/pair.hpp"
#include "unirit/random.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

const char* const kOrgans[] = {"liver", "kidney", "spleen", "gallbladder", "stomach"};

/// Directions, uniform on the sphere, of which those are kept that have a z of at least `lowest`.
Points unitSphere(Eigen::Index count, float lowest = -1.0F) {
  Random random(1);
  Points points(3, count);
  for (Eigen::Index i = 0; i < count;) {
    Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
    points.col(i) = direction.normalized().cast<float>();
    if (points(2, i) >= lowest) ++i;
  }
  return points;
}

RegistrationPair pairOf(const std::string& organ, Protocol protocol) {
  return makePair(makePhantom(organ, 1, 3000), protocol, 1024, 1);
}

Sighting sighted(const RegistrationPair& pair) {
  return sightingOf({pair.target, {}, pair.viewpoint}, sampledArea(pair.source));
}

TEST(SampledArea, IsThatOfTheSurfaceWhateverTheNumberOfSamples) {
  for (const Eigen::Index count : {500, 1024, 4000}) {
    EXPECT_NEAR(sampledArea(unitSphere(count)), 4.0 * M_PI, 0.15 * 4.0 * M_PI) << count;
    EXPECT_NEAR(sampledArea(2.0F * unitSphere(count)), 16.0 * M_PI, 0.15 * 16.0 * M_PI) << count;
  }
  EXPECT_NEAR(sampledArea(unitSphere(1024, 0.0F)), 2.0 * M_PI, 0.2 * 2.0 * M_PI);
}

TEST(SampledArea, IsHardlyMovedByOutliers) {
  Points points = unitSphere(1000);
  const double without = sampledArea(points);
  for (Eigen::Index i = 0; i < points.cols(); i += 20) points.col(i) *= 3.0F;
  EXPECT_NEAR(sampledArea(points), without, 0.1 * without);
}

TEST(Sighting, TellsWholeSurfacesFromParts) {
  for (const char* organ : kOrgans) {
    EXPECT_TRUE(sighted(pairOf(organ, Protocol::kResampled)).whole) << organ;
    EXPECT_TRUE(sighted(pairOf(organ, Protocol::kCaseB)).whole) << organ;
    EXPECT_FALSE(sighted(pairOf(organ, Protocol::kPartial)).whole) << organ;
    EXPECT_FALSE(sighted(pairOf(organ, Protocol::kIntraop)).whole) << organ;
  }
}

TEST(Sighting, OfAMoreOpenSurfaceThanItsAreaAllowsIsAPart) {
  const Points open = unitSphere(1024, -0.6F);  // its mean normal has a length of 0.2
  EXPECT_FALSE(sightingOf({open, {}}, sampledArea(open) / 0.8).whole);
  EXPECT_TRUE(sightingOf({open, {}}, sampledArea(open) / 0.85).whole);
}

TEST(Sighting, OfAPartIsFromTheViewpointItFaces) {
  const PointCloud cap{unitSphere(1024, 0.3F), {}, Eigen::Vector3f(0, 0, 5)};
  const Sighting sighting = sightingOf(cap, 4.0 * M_PI);
  ASSERT_FALSE(sighting.whole);
  EXPECT_EQ(*sighting.eye, *cap.viewpoint);
  const Points& points = sighting.seen.points;
  EXPECT_GT(sighting.seen.normals.cwiseProduct(points).colwise().sum().minCoeff(), 0.5F);
}

TEST(Sighting, OfAPartIsFromItsNormalsWhereTheViewpointIsUnknownOrWrong) {
  PointCloud half{unitSphere(1024, 0.0F), {}};
  for (const bool wrong : {false, true}) {
    if (wrong) half.viewpoint = Eigen::Vector3f(0, 0, -5);
    const Sighting sighting = sightingOf(half, 4.0 * M_PI);
    ASSERT_TRUE(sighting.eye.has_value());
    EXPECT_GT(sighting.eye->normalized().z(), 0.95F) << wrong;
  }
}

}  // namespace
}  // namespace unirit
