// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/thin_plate_spline.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"
#include "unirit/metrics.hpp"

namespace unirit {
namespace {

TEST(RandomDeformation, HasTheStrengthAskedForAndDoesNotFold) {
  const Points points = test::bumpyEllipsoid(1000, 1);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const ThinPlateSpline spline = randomDeformation(points, 0.015, seed);
    const Points moved = points + spline.displacements(points);
    EXPECT_NEAR(rootMeanSquareDistance(points, moved), 0.015, 1e-6);
    const auto folded = (spline.jacobianDeterminants(points).array() < 0.1F).count();
    EXPECT_LE(folded, 2);
  }
}

TEST(RandomDeformation, JacobianEqualsFiniteDifferences) {
  const Points points = test::bumpyEllipsoid(50, 2);
  const ThinPlateSpline spline = randomDeformation(points, 0.015, 3);
  const Eigen::RowVectorXf determinants = spline.jacobianDeterminants(points);
  const float step = 1e-3F;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    Eigen::Matrix3f jacobian = Eigen::Matrix3f::Identity();
    for (int axis = 0; axis < 3; ++axis) {
      const Points ahead = points.col(i) + step * Eigen::Vector3f::Unit(axis);
      const Points behind = points.col(i) - step * Eigen::Vector3f::Unit(axis);
      jacobian.col(axis) +=
          (spline.displacements(ahead) - spline.displacements(behind)) / (2.0F * step);
    }
    EXPECT_NEAR(determinants[i], jacobian.determinant(), 5e-3F);
  }
}

TEST(RandomDeformation, DependsOnTheSeedAlone) {
  const Points points = test::bumpyEllipsoid(300, 4);
  const auto moved = [&](std::uint64_t seed) {
    return randomDeformation(points, 0.015, seed).displacements(points);
  };
  EXPECT_EQ(moved(5), moved(5));
  EXPECT_NE(moved(5), moved(6));
}

TEST(RandomDeformation, RefusesWhatItCannotDo) {
  const Points points = test::bumpyEllipsoid(300, 4);
  EXPECT_THROW(randomDeformation(points.leftCols(3), 0.01, 1), std::invalid_argument);
  EXPECT_THROW(randomDeformation(points, -0.01, 1), std::invalid_argument);
  EXPECT_THROW(randomDeformation(points, 10.0, 1), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
