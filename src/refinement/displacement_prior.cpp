// SPDX-License-Identifier: BSD-3-Clause
#include "displacement_prior.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "unirit/sampling.hpp"

namespace unirit {
namespace {

constexpr Eigen::Index kInducingPoints = 128;
constexpr double kJitter = 1e-5;       // of the variance: keeps the covariance positive definite
constexpr Eigen::Index kBlock = 1024;  // points evaluated together, to stay in the cache

}  // namespace

DisplacementPrior::DisplacementPrior(const Points& surface, double length, double amplitude,
                                     int rank)
    : inducing_(select(surface, sampleEvenly(surface, kInducingPoints))),
      exponent_(static_cast<float>(-0.5 / (length * length))),
      variance_(static_cast<float>(amplitude * amplitude)) {
  const Eigen::Index count = inducing_.cols();
  Eigen::MatrixXd covariance = covariances(inducing_).cast<double>();
  covariance.diagonal().array() += kJitter;
  const Eigen::LLT<Eigen::MatrixXd> factor(covariance);

  // Whitened covariances are functions with standard normal coefficients; turned to principal axes
  const Eigen::MatrixXd whitened =
      factor.matrixL().solve(covariances(surface).cast<double>());  // inducing x N
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(whitened * whitened.transpose());
  const Eigen::Index kept = std::min<Eigen::Index>(rank, count);
  weights_ =
      (amplitude * factor.matrixU().solve(axes.eigenvectors().rightCols(kept))).cast<float>();
}

Eigen::MatrixXf DisplacementPrior::covariances(const Points& points) const {
  Eigen::MatrixXf distances(inducing_.cols(), points.cols());
  for (Eigen::Index q = 0; q < points.cols(); ++q) {
    distances.col(q) = (inducing_.colwise() - points.col(q)).colwise().squaredNorm().transpose();
  }
  return (exponent_ * distances.array()).exp();
}

Eigen::MatrixXf DisplacementPrior::functions(const Points& points) const {
  return weights_.transpose() * covariances(points);
}

Points DisplacementPrior::displacements(const Points& points,
                                        const Eigen::Matrix3Xf& coefficients) const {
  const Eigen::Matrix3Xf weights = coefficients * weights_.transpose();
  Points displacements(3, points.cols());
  for (Eigen::Index begin = 0; begin < points.cols(); begin += kBlock) {
    const Eigen::Index count = std::min(kBlock, points.cols() - begin);
    displacements.middleCols(begin, count).noalias() =
        weights * covariances(points.middleCols(begin, count));
  }
  return displacements;
}

}  // namespace unirit
