// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "drift_steps.hpp"
#include "gaussian_basis.hpp"

namespace unirit {
namespace {

void requireValid(const DriftClouds& clouds, const BcpdSettings& settings) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  requirePoints(clouds);
  requireWithin("beta", settings.beta, 0.0, kInfinity, false);
  requireWithin("lambda", settings.lambda, 0.0, kInfinity, false);
  requireWithin("omega", settings.omega, 0.0, 1.0, true);
  requireWithin("gamma", settings.gamma, 0.0, kInfinity, false);
  requireWithin("kernel_tolerance", settings.kernel_tolerance, 0.0, 1.0, false);
}

/// Volume of the box around the points: outliers are uniform in it.
double boxVolume(const Eigen::Matrix3Xd& points) {
  return (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).prod();
}

}  // namespace

Drift driftBayesian(const DriftClouds& clouds, const BcpdSettings& settings) {
  requireValid(clouds, settings);
  const GaussianBasis basis(clouds.source, settings.beta, settings.kernel_tolerance);
  const double odds = settings.omega / (1.0 - settings.omega) *
                      static_cast<double>(clouds.source.cols()) / boxVolume(clouds.target);
  Drift drift;
  drift.source = clouds.source;
  drift.variance = settings.gamma * settings.gamma * meanVariance(clouds);
  Eigen::Matrix3Xd coefficients;
  while (drift.iterations < settings.iterations) {
    const Responsibilities explained =
        responsibilities(drift.source, clouds.target, drift.variance,
                         odds * std::pow(2.0 * M_PI * drift.variance, 1.5));

    // Displacements, in the source's frame
    const Similarity& pose = drift.pose;
    const Eigen::Matrix3Xd seen =
        pose.rotation.transpose() *
        (explained.weighted_targets - pose.translation * explained.of_source) / pose.scale;
    coefficients =
        basis.fit(explained.of_source, seen - clouds.source * explained.of_source.asDiagonal(),
                  settings.lambda * drift.variance / (pose.scale * pose.scale));
    const Eigen::Matrix3Xd deformed = clouds.source + coefficients * basis.values().transpose();

    // Pose and deviation
    drift.pose = fitSimilarity(deformed, explained, settings.scale);
    drift.source = drift.pose * deformed;
    const double before = std::sqrt(drift.variance);
    drift.variance = std::max(
        explained.squaredDistances(clouds.target, drift.source) / (3.0 * explained.total()),
        kSmallestVariance);
    const double deviation = std::sqrt(drift.variance);
    ++drift.iterations;
    if (drift.iterations > settings.settling + 1 &&
        std::min(deviation, std::abs(before - deviation)) < settings.tolerance) {
      break;
    }
  }
  drift.interior =
      drift.pose * (clouds.interior + coefficients * basis.at(clouds.interior).transpose());
  return drift;
}

}  // namespace unirit
