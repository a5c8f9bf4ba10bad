// SPDX-License-Identifier: BSD-3-Clause
#include "drift_steps.hpp"

#include <Eigen/SVD>
#include <sstream>
#include <stdexcept>

namespace unirit {

void requirePoints(const DriftClouds& clouds) {
  if (clouds.source.cols() == 0 || clouds.target.cols() == 0) {
    throw std::invalid_argument("clouds: source and target must have points");
  }
}

void requireWithin(const std::string& name, double value, double low, double high,
                   bool low_allowed) {
  if ((value > low || (low_allowed && value == low)) && value < high) return;
  std::ostringstream sentence;
  sentence << name << ": " << value << " is outside " << (low_allowed ? "[" : "(") << low << ", "
           << high << ")";
  throw std::invalid_argument(sentence.str());
}

double meanVariance(const DriftClouds& clouds) {
  const auto meanSquare = [](const Eigen::Matrix3Xd& points) {
    return points.squaredNorm() / static_cast<double>(points.cols());
  };
  const double product = clouds.source.rowwise().mean().dot(clouds.target.rowwise().mean());
  return (meanSquare(clouds.source) + meanSquare(clouds.target) - 2.0 * product) / 3.0;
}

Similarity fitSimilarity(const Eigen::Matrix3Xd& source, const Responsibilities& responsibilities,
                         bool with_scale) {
  const double total = responsibilities.total();
  const Eigen::RowVectorXd& weights = responsibilities.of_source;
  const Eigen::Vector3d target_mean = responsibilities.weighted_targets.rowwise().sum() / total;
  const Eigen::Vector3d source_mean = source * weights.transpose() / total;
  const Eigen::Matrix3Xd centred = source.colwise() - source_mean;
  const Eigen::Matrix3d covariance = responsibilities.weighted_targets * centred.transpose();

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs.z() = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  Similarity fit;
  fit.rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  if (with_scale) {
    fit.scale =
        fit.rotation.cwiseProduct(covariance).sum() / weights.dot(centred.colwise().squaredNorm());
  }
  fit.translation = target_mean - fit.scale * fit.rotation * source_mean;
  return fit;
}

}  // namespace unirit
