// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/gaussian_mixture.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "unirit/random.hpp"

namespace unirit {
namespace {

constexpr int kMostSteps = 300;
constexpr double kLeastGain = 1e-6;
constexpr double kFloor = 1e-5;  // of the cloud's mean variance

/// log(sum(exp(row))) of each row.
Eigen::ArrayXd logSumExp(const Eigen::ArrayXXd& logarithms) {
  const Eigen::ArrayXd largest = logarithms.rowwise().maxCoeff();
  return largest + (logarithms.colwise() - largest).exp().rowwise().sum().log();
}

/// Centres drawn with a probability that grows with the squared distance to those before.
Eigen::Matrix3Xd drawCentres(const Eigen::Matrix3Xd& points, int count, Random& random) {
  Eigen::Matrix3Xd centres(3, count);
  centres.col(0) = points.col(random.below(points.cols()));
  Eigen::RowVectorXd distances = (points.colwise() - centres.col(0)).colwise().squaredNorm();
  for (int k = 1; k < count; ++k) {
    double place = random.uniform(0.0, distances.sum());
    Eigen::Index chosen = 0;
    while (chosen + 1 < points.cols() && (place -= distances[chosen]) >= 0.0) ++chosen;
    centres.col(k) = points.col(chosen);
    distances = distances.cwiseMin((points.colwise() - centres.col(k)).colwise().squaredNorm());
  }
  return centres;
}

}  // namespace

GaussianMixture::GaussianMixture(const Points& cloud, int components, std::uint64_t seed) {
  if (components < 1) throw std::invalid_argument("components: must be positive");
  if (cloud.cols() < components) {
    throw std::invalid_argument("cloud: has fewer points than the mixture components");
  }
  const Eigen::Matrix3Xd points = cloud.cast<double>();
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d covariance =
      centred * centred.transpose() / static_cast<double>(points.cols());
  floor_ = kFloor * covariance.trace() / 3.0;
  if (!(floor_ > 0.0)) throw std::invalid_argument("cloud: is a single place");

  start(points, covariance, components, seed);
  double before = -std::numeric_limits<double>::infinity();
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::ArrayXXd joint = jointLogDensities(points);
    const Eigen::ArrayXd total = logSumExp(joint);
    maximise(points, (joint.colwise() - total).exp());
    const double likelihood = total.mean();
    if (likelihood - before < kLeastGain) break;
    before = likelihood;
  }
}

void GaussianMixture::start(const Eigen::Matrix3Xd& points, const Eigen::Matrix3d& covariance,
                            int components, std::uint64_t seed) {
  Random random(seed);
  const Eigen::Matrix3Xd centres = drawCentres(points, components, random);
  // Components that share the cloud's volume
  const double share = std::pow(components, -2.0 / 3.0);
  for (int k = 0; k < components; ++k) {
    components_.push_back({-std::log(components), centres.col(k),
                           share * covariance + floor_ * Eigen::Matrix3d::Identity()});
  }
}

/// Logarithm of weight times density, a point a row, a component a column.
Eigen::ArrayXXd GaussianMixture::jointLogDensities(const Eigen::Matrix3Xd& points) const {
  Eigen::ArrayXXd joint(points.cols(), static_cast<Eigen::Index>(components_.size()));
  for (std::size_t k = 0; k < components_.size(); ++k) {
    const Component& component = components_[k];
    const Eigen::LLT<Eigen::Matrix3d> factor(component.covariance);
    const Eigen::Matrix3d lower = factor.matrixL();
    const double log_determinant = 2.0 * lower.diagonal().array().log().sum();
    const Eigen::Matrix3Xd whitened =
        lower.triangularView<Eigen::Lower>().solve(points.colwise() - component.mean);
    joint.col(static_cast<Eigen::Index>(k)) =
        component.log_weight - 0.5 * (3.0 * std::log(2.0 * M_PI) + log_determinant +
                                      whitened.colwise().squaredNorm().transpose().array());
  }
  return joint;
}

void GaussianMixture::maximise(const Eigen::Matrix3Xd& points,
                               const Eigen::ArrayXXd& responsibilities) {
  constexpr double kTiny = 1e-300;  // a component that owns nothing stays where it is
  for (std::size_t k = 0; k < components_.size(); ++k) {
    Component& component = components_[k];
    const Eigen::VectorXd shares = responsibilities.col(static_cast<Eigen::Index>(k));
    const double owned = shares.sum();
    component.log_weight = std::log(std::max(owned, kTiny) / static_cast<double>(points.cols()));
    if (owned <= kTiny) continue;
    component.mean = points * shares / owned;
    const Eigen::Matrix3Xd centred = points.colwise() - component.mean;
    component.covariance = centred * shares.asDiagonal() * centred.transpose() / owned +
                           floor_ * Eigen::Matrix3d::Identity();
  }
}

Eigen::VectorXd GaussianMixture::logDensities(const Points& points) const {
  return logSumExp(jointLogDensities(points.cast<double>()));
}

double mixtureDivergence(const Points& x, const GaussianMixture& mixture_x, const Points& y,
                         const GaussianMixture& mixture_y) {
  const double over_x = (mixture_x.logDensities(x) - mixture_y.logDensities(x)).mean();
  const double over_y = (mixture_y.logDensities(y) - mixture_x.logDensities(y)).mean();
  return (over_x + over_y) / 2.0;
}

double mixtureDivergence(const Points& x, const Points& y, int components, std::uint64_t seed) {
  return mixtureDivergence(x, GaussianMixture(x, components, seed), y,
                           GaussianMixture(y, components, seed));
}

}  // namespace unirit
