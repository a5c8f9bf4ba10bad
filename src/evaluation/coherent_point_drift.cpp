// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "drift_steps.hpp"
#include "gaussian_basis.hpp"

namespace unirit {
namespace {

void requireValid(const DriftClouds& clouds, const CpdSettings& settings) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  requirePoints(clouds);
  requireWithin("beta", settings.beta, 0.0, kInfinity, false);
  requireWithin("lambda", settings.lambda, 0.0, kInfinity, false);
  requireWithin("w", settings.outliers, 0.0, 1.0, true);
  requireWithin("kernel_tolerance", settings.kernel_tolerance, 0.0, 1.0, false);
}

/// Alternates expectation and `maximise`, which moves drift.source and returns the energy of its
/// displacements.
template <class Maximise>
Drift alternate(const DriftClouds& clouds, const CpdSettings& settings, Maximise&& maximise) {
  const auto sources = static_cast<double>(clouds.source.cols());
  const auto targets = static_cast<double>(clouds.target.cols());
  const double odds = settings.outliers / (1.0 - settings.outliers) * sources / targets;
  Drift drift;
  drift.source = clouds.source;
  drift.variance = meanVariance(clouds);
  double change = std::numeric_limits<double>::infinity(), last = 0.0, energy = 0.0;
  while (drift.iterations < settings.iterations && change > settings.tolerance &&
         drift.variance > kSmallestVariance) {
    const Responsibilities explained =
        responsibilities(drift.source, clouds.target, drift.variance,
                         odds * std::pow(2.0 * M_PI * drift.variance, 1.5));
    const double objective = 1.5 * targets * std::log(drift.variance) - explained.log_sum + energy;
    change = std::abs((objective - last) / objective);
    last = objective;
    energy = maximise(explained, drift);
    drift.variance = std::abs(explained.squaredDistances(clouds.target, drift.source)) /
                     (3.0 * explained.total());
    ++drift.iterations;
  }
  return drift;
}

}  // namespace

Drift driftRigidly(const DriftClouds& clouds, const CpdSettings& settings) {
  requireValid(clouds, settings);
  Drift drift = alternate(clouds, settings, [&](const Responsibilities& explained, Drift& current) {
    current.pose = fitSimilarity(clouds.source, explained, false);
    current.source = current.pose * clouds.source;
    return 0.0;
  });
  drift.interior = drift.pose * clouds.interior;
  return drift;
}

Drift driftCoherently(const DriftClouds& clouds, const CpdSettings& settings) {
  requireValid(clouds, settings);
  const GaussianBasis basis(clouds.source, settings.beta, settings.kernel_tolerance);
  Eigen::Matrix3Xd coefficients = Eigen::Matrix3Xd::Zero(3, basis.values().cols());
  Drift drift = alternate(clouds, settings, [&](const Responsibilities& explained, Drift& current) {
    const Eigen::Matrix3Xd residuals =
        explained.weighted_targets - clouds.source * explained.of_source.asDiagonal();
    coefficients = basis.fit(explained.of_source, residuals, settings.lambda * current.variance);
    current.source = clouds.source + coefficients * basis.values().transpose();
    return settings.lambda / 2.0 * coefficients.squaredNorm();
  });
  drift.interior = clouds.interior + coefficients * basis.at(clouds.interior).transpose();
  return drift;
}

}  // namespace unirit
