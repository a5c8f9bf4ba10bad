// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/organ_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

const Points& organ() {
  static const Points points = makePhantom("liver", 0, 1000).vertices.points;
  return points;
}

MotionSettings still() {
  MotionSettings settings;
  settings.breathing_amplitude = 0.0;
  settings.bulge_amplitude = 0.0;
  settings.deformation = 0.0;
  settings.rigid_rotation = 0.0;
  settings.rigid_translation = 0.0;
  return settings;
}

// The largest displacement over two minutes, over the organ's extent.
double largestDisplacement(const MotionSettings& settings) {
  const OrganMotion motion(organ(), settings, 3);
  float largest = 0.0F;
  for (double t = 0.0; t < 120.0; t += 0.25) {
    largest = std::max(largest, (motion.at(organ(), t) - organ()).colwise().norm().maxCoeff());
  }
  return largest / extent(organ());
}

TEST(OrganMotion, WithoutAnyMotionIsTheIdentity) {
  const OrganMotion motion(organ(), still(), 1);
  for (const double t : {0.0, 1.0, 17.3}) {
    EXPECT_LT((motion.at(organ(), t) - organ()).cwiseAbs().maxCoeff(), 1e-6F);
  }
}

TEST(OrganMotion, IsContinuousInTime) {
  const OrganMotion motion(organ(), {}, 2);
  for (double t = 0.0; t < 60.0; t += 0.37) {
    const float step =
        (motion.at(organ(), t + 1e-3) - motion.at(organ(), t)).colwise().norm().maxCoeff();
    EXPECT_LT(step, 1e-3 * extent(organ())) << t;
  }
  EXPECT_GT((motion.at(organ(), 2.0) - motion.at(organ(), 0.0)).colwise().norm().minCoeff(), 0.0F);
}

TEST(OrganMotion, BreathingShiftsAlongOneAxisByItsAmplitude) {
  MotionSettings settings = still();
  settings.breathing_amplitude = 0.04;
  const OrganMotion motion(organ(), settings, 1);
  const Points moved = motion.at(organ(), 0.5 * settings.breathing_period) - organ();
  EXPECT_LT(moved.topRows<2>().cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_LT((moved.row(2).array() + 0.04 * extent(organ())).abs().maxCoeff(), 1e-6F);
  EXPECT_LT((motion.at(organ(), settings.breathing_period) - organ()).cwiseAbs().maxCoeff(), 1e-6F);
}

TEST(OrganMotion, EachAmplitudeIsReachedAndNotExceeded) {
  MotionSettings settings = still();
  settings.bulge_amplitude = 0.05;
  EXPECT_NEAR(largestDisplacement(settings), 0.05, 0.001);
  settings = still();
  settings.rigid_translation = 0.05;
  EXPECT_NEAR(largestDisplacement(settings), 0.05, 0.001);
  settings = still();
  settings.rigid_rotation = 10.0;
  const double reach =
      (organ().colwise() - centroid(organ())).colwise().norm().maxCoeff() / extent(organ());
  EXPECT_LT(largestDisplacement(settings), 2.0 * reach * std::sin(5.0 * M_PI / 180.0) + 1e-6);
  EXPECT_GT(largestDisplacement(settings), 0.5 * reach * std::sin(5.0 * M_PI / 180.0));
}

TEST(OrganMotion, DeformationSwellsFromHalfToItsWholeStrength) {
  MotionSettings settings = still();
  settings.deformation = 0.03;
  const OrganMotion motion(organ(), settings, 4);
  const auto rms = [&](double t) {
    const Points moved = motion.at(organ(), t) - organ();
    return std::sqrt(moved.squaredNorm() / static_cast<double>(moved.cols())) / extent(organ());
  };
  EXPECT_NEAR(rms(0.0), 0.015, 1e-5);
  EXPECT_NEAR(rms(0.5 * settings.breathing_period), 0.03, 1e-5);
}

TEST(OrganMotion, MovesAnyPointAsItMovesTheOrgans) {
  const OrganMotion motion(organ(), {}, 5);
  const Points part = organ().middleCols(100, 20);
  EXPECT_LT(
      (motion.at(part, 3.3) - motion.at(organ(), 3.3).middleCols(100, 20)).cwiseAbs().maxCoeff(),
      1e-6F);
}

TEST(OrganMotion, IsDeterministicForASeed) {
  const Points first = OrganMotion(organ(), {}, 6).at(organ(), 2.5);
  EXPECT_EQ(first, OrganMotion(organ(), {}, 6).at(organ(), 2.5));
  EXPECT_NE(first, OrganMotion(organ(), {}, 7).at(organ(), 2.5));
}

TEST(OrganMotion, RefusesSettingsThatMakeNoMotion) {
  const auto refuses = [](double MotionSettings::*field, double value) {
    MotionSettings settings;
    settings.*field = value;
    EXPECT_THROW(OrganMotion(organ(), settings, 0), std::invalid_argument);
  };
  refuses(&MotionSettings::breathing_period, 0.0);
  refuses(&MotionSettings::breathing_amplitude, -0.01);
  refuses(&MotionSettings::bulge_amplitude, std::numeric_limits<double>::infinity());
  refuses(&MotionSettings::deformation, -1.0);
  refuses(&MotionSettings::rigid_rotation, std::numeric_limits<double>::quiet_NaN());
  refuses(&MotionSettings::rigid_translation, -0.01);
  EXPECT_THROW(OrganMotion(organ().leftCols(3), {}, 0), std::invalid_argument);
  EXPECT_THROW(OrganMotion(Points(3, 0), {}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
