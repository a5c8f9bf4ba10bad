// SPDX-License-Identifier: BSD-3-Clause
#include "network/coherent_way.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "instruction_set_test.hpp"
#include "network_inputs.hpp"

namespace unirit {
namespace {

/// An ellipsoid's points and normals.
class CoherentWayTest : public InstructionSetTest {
 protected:
  CoherentWayTest() {
    const Eigen::Vector3f curvature(4.0F, 8.0F, 16.0F);  // inverse squared half axes
    normals_ = curvature.asDiagonal() * points_;
    normals_.colwise().normalize();
  }

  /// Where the fitted motion takes each point.
  Points ways(const Points& queries) const {
    Points ways(3, queries.cols());
    for (Eigen::Index q = 0; q < queries.cols(); ++q) {
      ways.col(q) = way_.rigid(queries.col(q));
      for (Eigen::Index j = 0; j < way_.sources().cols(); ++j) {
        const float distance = (queries.col(q) - points_.col(j)).norm() / kFlowLength;
        ways.col(q) += std::exp(-0.5F * distance * distance) * way_.sources().col(j);
      }
    }
    return ways;
  }

  static float meanLength(const Points& vectors) { return vectors.colwise().norm().mean(); }

  Points points_ = test::surfacePoints(kFlowPlanes, 1), normals_;
  CoherentWay way_{selectKernels()};
};

TEST_P(CoherentWayTest, nothingMovesWhatLiesOnItsPlanes) {
  way_.fit(points_, Points::Zero(3, points_.cols()), normals_);
  EXPECT_EQ(meanLength(ways(points_)), 0.0F);
}

TEST_P(CoherentWayTest, findsARigidMotionFromWaysAlongNormalsAlone) {
  const Eigen::Vector3f turn(0.1F, -0.05F, 0.08F), shift(0.05F, 0.1F, -0.08F);
  Points motion(3, points_.cols()), along_normals = motion;
  for (Eigen::Index j = 0; j < points_.cols(); ++j) {
    motion.col(j) = shift + turn.cross(points_.col(j));
    along_normals.col(j) = normals_.col(j).dot(motion.col(j)) * normals_.col(j);
  }
  way_.fit(points_, along_normals, normals_);
  EXPECT_LT(meanLength(ways(points_) - motion), 0.2F * meanLength(motion));
  EXPECT_GT(meanLength(along_normals - motion), 0.5F * meanLength(motion));
}

TEST_P(CoherentWayTest, findsASmoothDeformationOfPointsNotGivenToIt) {
  const auto bend = [](const Points& points) {
    Points bent = Points::Zero(3, points.cols());
    bent.row(2) = 0.5F * points.row(0).cwiseAbs2();
    return bent;
  };
  way_.fit(points_, bend(points_), normals_);
  const Points others = test::surfacePoints(100, 2);
  EXPECT_LT(meanLength(ways(others) - bend(others)), 0.5F * meanLength(bend(others)));
}

TEST_P(CoherentWayTest, trustsFarOffsetsLess) {
  const Points up = Eigen::Vector3f::UnitZ() * Eigen::RowVectorXf::Ones(points_.cols());
  way_.fit(points_, 0.05F * up, normals_);
  const float near = meanLength(ways(points_)) / 0.05F;
  way_.fit(points_, 20.0F * up, normals_);
  EXPECT_GT(near, 0.9F);
  EXPECT_LT(meanLength(ways(points_)) / 20.0F, 0.7F * near);
}

TEST_P(CoherentWayTest, onePlaneAndManyInOnePlaceAreFitted) {
  const Points one = points_.leftCols(1), normal = normals_.leftCols(1);
  way_.fit(one, 0.1F * normal, normal);
  const Eigen::Vector3f alone = way_.rigid(one.col(0)) + way_.sources().col(0);
  EXPECT_GT(alone.dot(normal.col(0)), 0.05F);

  const auto repeated = [](const Points& point) { return Points(point.replicate(1, 100)); };
  way_.fit(repeated(one), 0.1F * repeated(normal), repeated(normal));
  EXPECT_TRUE(way_.sources().allFinite());
  EXPECT_NEAR(normal.col(0).dot(way_.rigid(one.col(0)) + way_.sources().rowwise().sum()), 0.1F,
              0.01F);
}

TEST_P(CoherentWayTest, roundingLeavesASolutionOfCloudsFarOutOfTheUnit) {
  for (const float scale : {1e-3F, 1e3F, 1e6F}) {
    way_.fit(scale * points_, scale * 0.1F * normals_, normals_);
    EXPECT_TRUE(way_.sources().allFinite()) << scale;
    EXPECT_TRUE(way_.rigid(points_.col(0)).allFinite()) << scale;
  }
}

TEST_P(CoherentWayTest, whatIsNotFiniteComesOutOrIsRefused) {
  Points offsets = Points::Zero(3, points_.cols());
  offsets(1, 7) = std::numeric_limits<float>::quiet_NaN();
  try {
    way_.fit(points_, offsets, normals_);
    EXPECT_FALSE(way_.sources().allFinite());
  } catch (const std::runtime_error&) {
  }
}

UNIRIT_ON_EVERY_INSTRUCTION_SET(CoherentWayTest);

}  // namespace
}  // namespace unirit
