// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/point_drift.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "gaussian_basis.hpp"
#include "responsibilities.hpp"
#include "shapes.hpp"

namespace unirit {
namespace {

/// About the centroid, in units of the RMS radius.
Eigen::Matrix3Xd organ(Eigen::Index points, std::uint64_t seed) {
  Eigen::Matrix3Xd cloud = test::bumpyEllipsoid(points, seed).cast<double>();
  cloud.colwise() -= Eigen::Vector3d(cloud.rowwise().mean());
  return cloud / std::sqrt(cloud.squaredNorm() / static_cast<double>(points));
}

Eigen::Matrix3Xd bent(const Eigen::Matrix3Xd& points) {
  Eigen::Matrix3Xd moved = points;
  moved.row(2).array() += 0.2 * points.row(0).array().square();
  moved.row(1).array() += 0.1 * points.row(0).array().sin();
  return moved;
}

double rms(const Eigen::Matrix3Xd& difference) {
  return std::sqrt(difference.squaredNorm() / static_cast<double>(difference.cols()));
}

TEST(Responsibilities, AreThoseOfTheFormulaTermByTerm) {
  const Eigen::Matrix3Xd source = organ(70, 1), target = bent(organ(90, 2));
  const double variance = 0.04, outlier = 0.3;
  Eigen::MatrixXd p(source.cols(), target.cols());
  double log_sum = 0.0;
  for (Eigen::Index n = 0; n < target.cols(); ++n) {
    for (Eigen::Index m = 0; m < source.cols(); ++m) {
      p(m, n) = std::exp(-(target.col(n) - source.col(m)).squaredNorm() / (2.0 * variance));
    }
    const double denominator = p.col(n).sum() + outlier;
    p.col(n) /= denominator;
    log_sum += std::log(denominator);
  }
  const Responsibilities sums = responsibilities(source, target, variance, outlier);
  EXPECT_TRUE(sums.of_source.isApprox(p.rowwise().sum().transpose(), 1e-12));
  EXPECT_TRUE(sums.of_target.isApprox(p.colwise().sum(), 1e-12));
  EXPECT_TRUE(sums.weighted_targets.isApprox(target * p.transpose(), 1e-12));
  EXPECT_NEAR(sums.log_sum, log_sum, 1e-9);
  double squares = 0.0;
  for (Eigen::Index n = 0; n < target.cols(); ++n) {
    for (Eigen::Index m = 0; m < source.cols(); ++m) {
      squares += p(m, n) * (target.col(n) - source.col(m)).squaredNorm();
    }
  }
  EXPECT_NEAR(sums.squaredDistances(target, source), squares, 1e-9);
}

TEST(Responsibilities, OfTargetsOutOfReachVanish) {
  const Eigen::Matrix3Xd source = organ(20, 1);
  const Eigen::Matrix3Xd far = source.colwise() + Eigen::Vector3d(1e3, 0, 0);
  const Responsibilities sums = responsibilities(source, far, 1e-4, 0.0);
  EXPECT_LT(sums.of_source.maxCoeff(), 1e-50);
  EXPECT_LT(sums.weighted_targets.cwiseAbs().maxCoeff(), 1e-40);
}

TEST(GaussianBasis, ItsProductsAreTheKernel) {
  const Eigen::Matrix3Xd points = organ(150, 3);
  for (const double width : {0.3, 1.0, 2.0}) {
    Eigen::MatrixXd kernel(points.cols(), points.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      kernel.col(i) = ((points.colwise() - points.col(i)).colwise().squaredNorm().array() /
                       (-2.0 * width * width))
                          .exp()
                          .matrix()
                          .transpose();
    }
    for (const double tolerance : {1e-5, 1e-7, 1e-9}) {
      const GaussianBasis basis(points, width, tolerance);
      const Eigen::MatrixXd product = basis.values() * basis.values().transpose();
      EXPECT_LT((product - kernel).cwiseAbs().maxCoeff(), 2.0 * tolerance) << width;
      EXPECT_LT((basis.at(points) - basis.values()).cwiseAbs().maxCoeff(), 1e-4) << width;
    }
  }
  const auto functions = [&](double tolerance) {
    return GaussianBasis(points, 2.0, tolerance).values().cols();
  };
  EXPECT_LT(functions(1e-7), 120);  // smooth fields are few
  EXPECT_LT(functions(1e-7), functions(1e-9));
  EXPECT_EQ(GaussianBasis(points, 2.0, 1e-7).at(Eigen::Matrix3Xd(3, 0)).rows(), 0);
}

TEST(GaussianBasis, FitIsTheMaximisationOfCoherentPointDrift) {
  // (diag(w) G + ridge I) W = w r, displacements G W: the form in which the paper has it.
  const Eigen::Matrix3Xd points = organ(80, 4);
  const GaussianBasis basis(points, 1.0, 1e-7);
  const Eigen::RowVectorXd weights = Eigen::RowVectorXd::LinSpaced(80, 0.0, 2.0);
  const Eigen::Matrix3Xd residuals = (bent(points) - points) * weights.asDiagonal();
  const double ridge = 0.05;
  const Eigen::MatrixXd kernel = basis.values() * basis.values().transpose();
  Eigen::MatrixXd system = weights.asDiagonal() * kernel;
  system.diagonal().array() += ridge;
  const Eigen::MatrixXd expected =
      (kernel * system.partialPivLu().solve(residuals.transpose())).transpose();
  const Eigen::MatrixXd found = basis.fit(weights, residuals, ridge) * basis.values().transpose();
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(RigidDrift, FindsAKnownPoseAmongOutliers) {
  const Eigen::Matrix3Xd source = organ(200, 5);
  Eigen::Isometry3d pose(Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.translation() << 0.1, -0.2, 0.3;
  Eigen::Matrix3Xd target(3, 220);
  target << pose * source, 2.0 * Eigen::Matrix3Xd::Random(3, 20);
  CpdSettings settings;
  settings.tolerance = 1e-9;
  const Drift drift = driftRigidly({source, target, source.leftCols(3)}, settings);
  EXPECT_LT(rms(drift.source - pose * source), 0.01);
  EXPECT_TRUE(drift.pose.rotation.isApprox(pose.linear(), 0.01));
  EXPECT_EQ(drift.pose.scale, 1.0);
  EXPECT_TRUE(drift.interior.isApprox(drift.source.leftCols(3), 1e-12));
}

TEST(CoherentDrift, BendsWhereARigidMotionCannot) {
  const Eigen::Matrix3Xd source = organ(300, 6), truth = bent(source);
  const Drift rigid = driftRigidly({source, truth, source}, {});
  const Drift drift = driftCoherently({source, truth, source}, {});
  EXPECT_GT(rms(rigid.source - truth), 0.08);
  EXPECT_LT(rms(drift.source - truth), 0.03);
  EXPECT_LT(rms(drift.interior - drift.source), 1e-6);  // the field agrees with itself
}

TEST(CoherentDrift, AStifferFieldBendsLess) {
  const Eigen::Matrix3Xd source = organ(200, 7), truth = bent(source);
  CpdSettings stiff;
  stiff.lambda = 1e4;
  EXPECT_LT(rms(driftCoherently({source, truth, source}, stiff).source - source),
            rms(driftCoherently({source, truth, source}, {}).source - source));
}

TEST(BayesianDrift, FindsPoseAndBendTogether) {
  const Eigen::Matrix3Xd source = organ(300, 8);
  Eigen::Isometry3d pose(Eigen::AngleAxisd(0.4, Eigen::Vector3d(3, 1, 2).normalized()));
  pose.translation() << 0.2, 0.1, -0.1;
  const Eigen::Matrix3Xd truth = pose * bent(source);
  const Drift drift = driftBayesian({source, truth, source}, {});
  EXPECT_LT(rms(drift.source - truth), 0.05);
  EXPECT_LT(rms(drift.interior - drift.source), 1e-6);
}

TEST(BayesianDrift, KeepsTheSizeWithoutScale) {
  const Eigen::Matrix3Xd source = organ(200, 9);
  BcpdSettings settings;
  settings.lambda = 1e6;  // next to rigid
  settings.gamma = 0.2;
  const DriftClouds clouds{source, 1.3 * source, source};
  EXPECT_NEAR(driftBayesian(clouds, settings).pose.scale, 1.3, 0.02);
  settings.scale = false;
  const Drift drift = driftBayesian(clouds, settings);
  EXPECT_EQ(drift.pose.scale, 1.0);
  EXPECT_LT(rms(drift.source - source), 0.1);  // 0.3 to the target
}

/// How far apart two kernel tolerances leave the points after some iterations.
template <class Settings>
double apart(Drift (*drift)(const DriftClouds&, const Settings&), double tolerance, double other) {
  const Eigen::Matrix3Xd source = organ(60, 5), none(3, 0);
  const auto moved = [&](double kernel_tolerance) {
    Settings settings;
    settings.iterations = 5;
    settings.kernel_tolerance = kernel_tolerance;
    return drift({source, bent(source), none}, settings).source;
  };
  return rms(moved(tolerance) - moved(other));
}

TEST(Drifts, LeaveOutOfTheKernelWhatTheyAreTold) {
  EXPECT_GT(apart(driftCoherently, 0.3, 1e-9), 1e-4);
  EXPECT_GT(apart(driftBayesian, 0.3, 1e-9), 1e-4);
  EXPECT_LT(apart(driftCoherently, 1e-9, 1e-11), 1e-7);
  EXPECT_LT(apart(driftBayesian, 1e-9, 1e-11), 1e-7);
}

TEST(Drifts, RefuseEmptyCloudsAndSettingsOutOfRange) {
  const Eigen::Matrix3Xd cloud = organ(10, 1), none(3, 0);
  EXPECT_THROW(driftCoherently({cloud, none, none}, {}), std::invalid_argument);
  EXPECT_THROW(driftBayesian({none, cloud, none}, {}), std::invalid_argument);
  CpdSettings cpd;
  cpd.outliers = 1.0;
  EXPECT_THROW(driftRigidly({cloud, cloud, none}, cpd), std::invalid_argument);
  BcpdSettings bcpd;
  bcpd.lambda = 0.0;
  EXPECT_THROW(driftBayesian({cloud, cloud, none}, bcpd), std::invalid_argument);
  cpd = {};
  cpd.kernel_tolerance = 0.0;
  EXPECT_THROW(driftCoherently({cloud, cloud, none}, cpd), std::invalid_argument);
  bcpd = {};
  bcpd.kernel_tolerance = 0.0;
  EXPECT_THROW(driftBayesian({cloud, cloud, none}, bcpd), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
