// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/normals.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"
#include "unirit/metrics.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

/// Evenly spread points of a sphere about the origin, with outward normals (Fibonacci's spiral).
PointCloud sphere(Eigen::Index count, double radius) {
  PointCloud sphere{Points(3, count), Points(3, count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(count);
    const double angle = static_cast<double>(i) * M_PI * (3.0 - std::sqrt(5.0));
    const double ring = std::sqrt(1.0 - z * z);
    sphere.normals.col(i) =
        Eigen::Vector3d(ring * std::cos(angle), ring * std::sin(angle), z).cast<float>();
  }
  sphere.points = static_cast<float>(radius) * sphere.normals;
  return sphere;
}

/// Random points of a torus about the z axis, uniform by area, with outward normals.
PointCloud torus(Eigen::Index count, double radius, double tube) {
  Random random(11);
  PointCloud torus{Points(3, count), Points(3, count)};
  for (Eigen::Index i = 0; i < count;) {
    const double around = random.uniform(0.0, 2.0 * M_PI), along = random.uniform(0.0, 2.0 * M_PI);
    const double ring = radius + tube * std::cos(along);
    if (random.uniform(0.0, radius + tube) > ring) continue;
    const Eigen::Vector3d outwards(std::cos(around), std::sin(around), 0.0);
    const Eigen::Vector3d normal(std::cos(along) * outwards.x(), std::cos(along) * outwards.y(),
                                 std::sin(along));
    torus.points.col(i) = (radius * outwards + tube * normal).cast<float>();
    torus.normals.col(i++) = normal.cast<float>();
  }
  return torus;
}

PointCloud phantom(Eigen::Index count) {
  return sampleByArea(makePhantom("liver", 3, 4000), count, 5);
}

PointCloud joined(const PointCloud& a, const PointCloud& b) {
  PointCloud both{Points(3, a.size() + b.size()), Points(3, a.size() + b.size())};
  both.points << a.points, b.points;
  both.normals << a.normals, b.normals;
  return both;
}

/// Angles between lines [degree], whatever the normals' signs.
std::vector<float> angles(const Points& normals, const Points& expected) {
  std::vector<float> angles;
  for (Eigen::Index i = 0; i < normals.cols(); ++i) {
    const float cosine = std::abs(normals.col(i).dot(expected.col(i)));
    angles.push_back(std::acos(std::min(cosine, 1.0F)) * 180.0F / static_cast<float>(M_PI));
  }
  return angles;
}

Points flippedAtRandom(Points normals) {
  Random random(7);
  for (Eigen::Index i = 0; i < normals.cols(); ++i) {
    if (random.uniform() < 0.5) normals.col(i) *= -1.0F;
  }
  return normals;
}

/// Share of the normals that point to the same side as the expected ones.
double agreement(const Points& normals, const Points& expected) {
  const Eigen::RowVectorXf cosines = normals.cwiseProduct(expected).colwise().sum();
  return static_cast<double>((cosines.array() > 0.0F).count()) /
         static_cast<double>(cosines.size());
}

double agreementWhenOriented(const PointCloud& cloud) {
  Points normals = flippedAtRandom(estimateNormals(cloud.points));
  orientOutwards(cloud.points, normals);
  return agreement(normals, cloud.normals);
}

TEST(Normals, AreUnitVectorsAcrossTheSurface) {
  const PointCloud ball = sphere(1000, 0.1), ring = torus(2000, 0.1, 0.04), organ = phantom(2000);
  for (const PointCloud& cloud : {ball, ring, organ}) {
    const Points normals = estimateNormals(cloud.points);
    EXPECT_TRUE((normals.colwise().norm().array() - 1.0F).abs().maxCoeff() < 1e-5F);
  }
  EXPECT_LT(quantile(angles(estimateNormals(ball.points), ball.normals), 1.0), 3.0F);
  EXPECT_LT(quantile(angles(estimateNormals(ring.points), ring.normals), 0.95), 8.0F);
  EXPECT_LT(quantile(angles(estimateNormals(organ.points), organ.normals), 0.9), 15.0F);
}

TEST(Normals, OfThreePointsAreThatOfTheirPlane) {
  Points triangle(3, 3);
  triangle << 0, 1, 0, 0, 0, 1, 2, 2, 2;
  const Points normals = estimateNormals(triangle);
  EXPECT_LT((normals.row(2).cwiseAbs().array() - 1.0F).abs().maxCoeff(), 1e-6F);
}

TEST(Normals, AreRefusedOfFewerThanThreePoints) {
  for (const int count : {0, 1, 2}) {
    EXPECT_THROW(estimateNormals(Points::Zero(3, count)), std::invalid_argument) << count;
  }
}

TEST(Normals, AreUnitVectorsWherePointsSpanNoPlane) {
  Points line = Points::Zero(3, 40);
  line.row(1).setLinSpaced(-1.0F, 1.0F);
  for (const Points& points : {line, Points(Points::Ones(3, 40))}) {
    const Eigen::RowVectorXf lengths = estimateNormals(points).colwise().norm();
    EXPECT_LT((lengths.array() - 1.0F).abs().maxCoeff(), 1e-5F);
  }
}

TEST(OrientOutwards, TurnsNormalsOfClosedSurfacesOutwards) {
  EXPECT_EQ(agreementWhenOriented(sphere(500, 0.1)), 1.0);
  EXPECT_EQ(agreementWhenOriented(torus(2000, 0.1, 0.04)), 1.0);
  EXPECT_GT(agreementWhenOriented(phantom(2000)), 0.99);
}

TEST(OrientOutwards, OrientsSeparatePiecesEachForItself) {
  PointCloud ball = sphere(500, 0.05), ring = torus(1500, 0.1, 0.04);
  ball.points.row(2).array() += 0.5F;
  EXPECT_EQ(agreementWhenOriented(joined(ball, ring)), 1.0);
}

TEST(OrientOutwards, DependsOnNeitherSignsNorOrder) {
  const PointCloud cloud = torus(1000, 0.1, 0.04);
  Points normals = estimateNormals(cloud.points);
  Points flipped = flippedAtRandom(normals);
  EXPECT_NE(flipped, normals);
  orientOutwards(cloud.points, normals);
  orientOutwards(cloud.points, flipped);
  EXPECT_EQ(flipped, normals);

  const Points other = test::shuffled(cloud.points, 9);
  Points other_normals = estimateNormals(other);
  orientOutwards(other, other_normals);
  const Points back = test::shuffled(normals, 9);  // the same permutation
  EXPECT_LT((other_normals - back).cwiseAbs().maxCoeff(), 1e-4F);
}

TEST(OutwardNormals, AreThoseEstimatedAndTurnedOutwards) {
  const PointCloud organ = phantom(1024);
  Points normals = estimateNormals(organ.points);
  orientOutwards(organ.points, normals);
  EXPECT_EQ(outwardNormals(organ.points), normals);
  for (const int count : {0, 1, 2}) {
    EXPECT_THROW(outwardNormals(Points::Zero(3, count)), std::invalid_argument) << count;
  }
}

TEST(OrientTowards, TurnsToTheViewpointWhatLooksAwayAndNothingElse) {
  const PointCloud ball = sphere(800, 0.1);
  const Eigen::Vector3f viewpoint(0.3F, -0.2F, 0.1F);
  Points normals = ball.normals;
  orientTowards(ball.points, viewpoint, normals);
  int turned = 0;
  for (Eigen::Index i = 0; i < ball.size(); ++i) {
    const bool faces = ball.normals.col(i).dot(viewpoint - ball.points.col(i)) >= 0.0F;
    EXPECT_EQ(normals.col(i), (faces ? 1.0F : -1.0F) * ball.normals.col(i)) << i;
    turned += faces ? 0 : 1;
  }
  EXPECT_GT(turned, 400);  // more than half of a sphere looks away from any viewpoint
  EXPECT_LT(turned, 800);
}

TEST(Openness, IsZeroOfClosedSurfacesAndHalfOfAHalfSphere) {
  const PointCloud ball = sphere(2000, 0.1);
  EXPECT_LT(openness(ball.normals), 1e-3);
  EXPECT_LT(openness(torus(4000, 0.1, 0.04).normals), 0.03);
  EXPECT_NEAR(openness(ball.normals.leftCols(1000)), 0.5, 1e-3);  // the spiral's upper half
  EXPECT_NEAR(openness(Eigen::Vector3f(0, 1, 0).replicate(1, 5)), 1.0, 1e-6);
}

}  // namespace
}  // namespace unirit
