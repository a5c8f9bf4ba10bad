// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

namespace unirit {

/// Clouds as the drifts take them; the settings' lengths are in their unit.
struct DriftClouds {
  Eigen::Matrix3Xd source;    ///< 3 x M, is moved
  Eigen::Matrix3Xd target;    ///< 3 x N, stands still
  Eigen::Matrix3Xd interior;  ///< 3 x K, is taken along
};

/// x -> scale * rotation * x + translation.
struct Similarity {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Matrix3Xd operator*(const Eigen::Matrix3Xd& points) const {
    return (scale * rotation * points).colwise() + translation;
  }
};

struct Drift {
  Eigen::Matrix3Xd source;    ///< moved
  Eigen::Matrix3Xd interior;  ///< moved
  Similarity pose;            ///< the rigid part; identity where the method has none
  double variance = 0.0;      ///< of the mixture's components, at the end
  int iterations = 0;
};

/// Settings of coherent point drift. visit() is the one list of them, by the names of the paper.
struct CpdSettings {
  double beta = 2.0;        ///< width of the displacement's Gaussian kernel
  double lambda = 2.0;      ///< weight of its energy
  double outliers = 0.1;    ///< w: share of outliers expected in the target, in [0, 1)
  double tolerance = 1e-5;  ///< ends where the likelihood changes by less than this share
  int iterations = 150;     ///< at most
  /// In (0, 1): the kernel's matrix, 1 on its diagonal, is approximated until no element of the
  /// diagonal is off by more.
  double kernel_tolerance = 1e-7;

  template <class Visitor>
  void visit(Visitor&& visitor) {
    visitor("beta", beta);
    visitor("lambda", lambda);
    visitor("w", outliers);
    visitor("tolerance", tolerance);
    visitor("iterations", iterations);
    visitor("kernel_tolerance", kernel_tolerance);
  }
};

/// Settings of Bayesian coherent point drift.
struct BcpdSettings {
  double beta = 2.0;        ///< width of the displacement's Gaussian kernel
  double lambda = 2.0;      ///< inverse variance of the displacements expected
  double omega = 0.0;       ///< share of outliers expected in the target, in [0, 1)
  double gamma = 1.0;       ///< start of the components' deviation, over that of the clouds
  double tolerance = 1e-4;  ///< ends where the deviation, or its change, is less than this
  int settling = 30;        ///< iterations before the tolerance is asked
  int iterations = 500;     ///< at most
  bool scale = true;        ///< similarity rather than rigid transform beside the displacements
  double kernel_tolerance = 1e-7;  ///< as of CpdSettings

  template <class Visitor>
  void visit(Visitor&& visitor) {
    visitor("beta", beta);
    visitor("lambda", lambda);
    visitor("omega", omega);
    visitor("gamma", gamma);
    visitor("tolerance", tolerance);
    visitor("settling", settling);
    visitor("iterations", iterations);
    visitor("scale", scale);
    visitor("kernel_tolerance", kernel_tolerance);
  }
};

/// Rigid coherent point drift without scale (Myronenko & Song, Point Set Registration: Coherent
/// Point Drift, 2010). beta, lambda and kernel_tolerance have no part in it. The three throw
/// std::invalid_argument on clouds without points or settings out of range.
Drift driftRigidly(const DriftClouds& clouds, const CpdSettings& settings);

/// Non-rigid coherent point drift, same paper.
Drift driftCoherently(const DriftClouds& clouds, const CpdSettings& settings);

/// Bayesian coherent point drift (Hirose, A Bayesian Formulation of Coherent Point Drift, 2021) as
/// its author's program does it by default: equal mixing weights, and the displacements' posterior
/// variance left out of the responsibilities, the scale and the deviation.
Drift driftBayesian(const DriftClouds& clouds, const BcpdSettings& settings);

}  // namespace unirit
