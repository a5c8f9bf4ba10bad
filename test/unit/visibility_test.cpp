// SPDX-License-Identifier: BSD-3-Clause
#include "refinement/visibility.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "unirit/random.hpp"

namespace unirit {
namespace {

const Eigen::Vector3f kEye(0.0F, 0.0F, 4.0F);

/// `count` samples of a square of side 1.6 that faces the eye at a height of z, turned about x.
PointCloud square(Eigen::Index count, float z, float tilt = 0.0F) {
  Random random(1);
  const Eigen::Matrix3f turn = Eigen::AngleAxisf(tilt, Eigen::Vector3f::UnitX()).matrix();
  PointCloud square{Points(3, count), Points(3, count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d at(random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), 0.0);
    square.points.col(i) = turn * at.cast<float>() + z * Eigen::Vector3f::UnitZ();
    square.normals.col(i) = turn.col(2);
  }
  return square;
}

PointCloud sphere(Eigen::Index count) {
  Random random(2);
  Points points(3, count);
  for (Eigen::Index i = 0; i < count; ++i) points.col(i) = random.direction().cast<float>();
  return {points, points};
}

PointCloud both(const PointCloud& a, const PointCloud& b) {
  PointCloud both{Points(3, a.size() + b.size()), Points(3, a.size() + b.size())};
  both.points << a.points, b.points;
  both.normals << a.normals, b.normals;
  return both;
}

Eigen::RowVectorXf visibility(const PointCloud& surface, const Eigen::Vector3f& eye) {
  return Visibility(surface.points).of(surface, eye);
}

TEST(Visibility, IsOneBeforeTheEyeAndZeroBehind) {
  const PointCloud two{(Points(3, 2) << 0, 0, 0, 0, 1, -1).finished(),
                       (Points(3, 2) << 0, 0, 0, 0, 1, -1).finished()};
  const Eigen::RowVectorXf seen = visibility(two, kEye);
  EXPECT_EQ(seen[0], 1.0F);
  EXPECT_EQ(seen[1], 0.0F);
  EXPECT_EQ(Visibility(two.points).of(two, std::nullopt), Eigen::RowVectorXf::Ones(2));
}

TEST(Visibility, IsLostBehindANearerPartOfTheSurface) {
  for (const Eigen::Index count : {150, 500}) {
    const PointCloud far = square(count, -0.4F);
    const Eigen::RowVectorXf seen = visibility(both(square(count, 0.4F), far), kEye);
    EXPECT_EQ(seen.head(count).minCoeff(), 1.0F) << count;
    EXPECT_LT(seen.tail(count).mean(), 0.2F) << count;  // seen from nearer, the near one is larger
    EXPECT_EQ(visibility(far, kEye).minCoeff(), 1.0F) << count;
  }
}

TEST(Visibility, OfAPartBesideANearerOneStays) {
  PointCloud near = square(400, 0.4F);
  near.points.row(0).array() += 2.0F;
  const Eigen::RowVectorXf seen = visibility(both(near, square(400, -0.4F)), kEye);
  EXPECT_GT(seen.mean(), 0.95F);
}

TEST(Visibility, OfASlopeIsNotLostBehindItsNearerEnd) {
  const Eigen::RowVectorXf seen = visibility(square(500, 0.0F, 1.0F), kEye);  // 57 degrees
  EXPECT_GT(seen.minCoeff(), 0.99F);
}

TEST(Visibility, OfAConvexSurfaceIsThatOfItsFacingPart) {
  const PointCloud ball = sphere(1000);
  const Eigen::RowVectorXf seen = visibility(ball, kEye);
  for (Eigen::Index i = 0; i < ball.size(); ++i) {
    const Eigen::Vector3f point = ball.points.col(i);
    const float cosine = point.dot((kEye - point).normalized());
    EXPECT_NEAR(seen[i], std::clamp((cosine - 0.1F) / 0.3F, 0.0F, 1.0F), 1e-3F) << cosine;
  }
}

TEST(Visibility, OfAHollowIsNotLostBehindItsOtherWallBeyondTheEye) {
  PointCloud bowl = sphere(2000);
  bowl.points.row(2) = -bowl.points.row(2).cwiseAbs();
  bowl.normals = -bowl.points;
  EXPECT_GT(visibility(bowl, {0.0F, 0.0F, -0.4F}).mean(), 0.8F);
}

TEST(Visibility, FollowsTheSurfaceWhateverTheSequenceOfItsSamples) {
  const PointCloud two = both(square(300, 0.4F), square(300, -0.4F));
  const PointCloud reversed{two.points.rowwise().reverse(), two.normals.rowwise().reverse()};
  const Eigen::RowVectorXf seen = visibility(two, kEye);
  EXPECT_EQ(visibility(reversed, kEye), seen.reverse());

  const Eigen::Isometry3f motion =
      Eigen::Translation3f(1, -2, 3) * Eigen::AngleAxisf(2.0F, Eigen::Vector3f(1, 2, 2) / 3.0F);
  const PointCloud moved{motion * two.points, motion.linear() * two.normals};
  const Eigen::RowVectorXf again = Visibility(two.points).of(moved, motion * kEye);
  EXPECT_LT((again - seen).cwiseAbs().maxCoeff(), 1e-3F);
}

TEST(Visibility, KeepsItsRangeWhereverTheEyeIs) {
  const PointCloud ball = sphere(200);
  const Eigen::Vector3f middle = centroid(ball.points);
  for (const Eigen::Vector3f& eye : {middle, Eigen::Vector3f(ball.points.col(0)),
                                     Eigen::Vector3f(0.5F, 0, 0), Eigen::Vector3f(1e6F, 0, 0)}) {
    const Eigen::RowVectorXf seen = visibility(ball, eye);
    EXPECT_TRUE((seen.array() >= 0.0F && seen.array() <= 1.0F).all()) << eye.transpose();
  }
}

}  // namespace
}  // namespace unirit
