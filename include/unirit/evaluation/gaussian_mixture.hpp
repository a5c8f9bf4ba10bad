// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// A mixture of normal distributions with full covariances.
class GaussianMixture {
 public:
  /// Fits a cloud by expectation maximisation (Dempster et al. 1977) from a k-means++ start (Arthur
  /// and Vassilvitskii 2007) until the mean log-likelihood gains less than 1e-6. A thousandth of a
  /// percent of the cloud's variance is added to every covariance, so that none degenerates.
  /// Deterministic for a seed. Throws std::invalid_argument where components < 1, or the cloud has
  /// fewer points than that or is a single place.
  GaussianMixture(const Points& cloud, int components, std::uint64_t seed);

  /// Logarithm of the density at each point, summed over the components without underflow.
  Eigen::VectorXd logDensities(const Points& points) const;

 private:
  struct Component {
    double log_weight = 0.0;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  };

  Eigen::ArrayXXd jointLogDensities(const Eigen::Matrix3Xd& points) const;
  void start(const Eigen::Matrix3Xd& points, const Eigen::Matrix3d& covariance, int components,
             std::uint64_t seed);
  void maximise(const Eigen::Matrix3Xd& points, const Eigen::ArrayXXd& responsibilities);

  std::vector<Component> components_;
  double floor_ = 0.0;  // added to the variances [squared unit of the cloud]
};

/// The paper's divergence L_mc between two clouds, each under a mixture of its own. The printed
/// formula, the mean of log G(X) - log G(Y) over N samples, has a sign and a direction, its table
/// has neither; this is the mean of both directions, each over the points of the cloud that stands
/// first: ([log G(X) - log G(Y)] over X + [log G(Y) - log G(X)] over Y) / 2. Zero for equal clouds.
double mixtureDivergence(const Points& x, const Points& y, int components, std::uint64_t seed);

/// The same where the mixtures are there already.
double mixtureDivergence(const Points& x, const GaussianMixture& mixture_x, const Points& y,
                         const GaussianMixture& mixture_y);

}  // namespace unirit
