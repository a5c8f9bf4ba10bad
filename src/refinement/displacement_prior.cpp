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

/// The derivative of exp(e |p - z|^2) is 2 e exp(e |p - z|^2) (p - z)^T.
std::vector<Eigen::Matrix3f> DisplacementPrior::gradients(
    const Points& points, const Eigen::Matrix3Xf& coefficients) const {
  const Eigen::Matrix3Xf weights = coefficients * weights_.transpose();
  Eigen::Matrix<float, 9, Eigen::Dynamic> moments(9, weights.cols());  // weight z^T, by columns
  for (int axis = 0; axis < 3; ++axis) {
    moments.middleRows<3>(3 * axis) = weights.array().rowwise() * inducing_.row(axis).array();
  }
  std::vector<Eigen::Matrix3f> gradients;
  gradients.reserve(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index begin = 0; begin < points.cols(); begin += kBlock) {
    const Points block = points.middleCols(begin, std::min(kBlock, points.cols() - begin));
    const Eigen::MatrixXf covariance = covariances(block);
    const Points displaced = weights * covariance;
    const Eigen::Matrix<float, 9, Eigen::Dynamic> sums = moments * covariance;
    for (Eigen::Index i = 0; i < block.cols(); ++i) {
      gradients.emplace_back(2.0F * exponent_ *
                             (displaced.col(i) * block.col(i).transpose() -
                              Eigen::Map<const Eigen::Matrix3f>(sums.col(i).data())));
    }
  }
  return gradients;
}

}  // namespace unirit
