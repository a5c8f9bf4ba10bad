// SPDX-License-Identifier: BSD-3-Clause
#include "displacement_prior.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "unirit/sampling.hpp"

namespace unirit {
namespace {

constexpr Eigen::Index kInducingPoints = 128;
constexpr double kJitter = 1e-5;      // of the variance: keeps the covariance positive definite
constexpr Eigen::Index kBlock = 192;  // points evaluated together, to stay in the cache
constexpr float kFarAway = 1e6F;      // where the padding lies

}  // namespace

DisplacementPrior::DisplacementPrior(const Points& surface, double length, double amplitude,
                                     int rank, const Kernels& kernels)
    : kernels_(kernels),
      inducing_(select(surface, sampleEvenly(surface, kInducingPoints))),
      exponent_(static_cast<float>(-0.5 / (length * length))),
      variance_(static_cast<float>(amplitude * amplitude)),
      padded_(inWholeBlocks(inducing_.cols())),
      targets_(static_cast<std::size_t>(3 * padded_)) {
  const Eigen::Index count = inducing_.cols();
  std::fill_n(targets_.data(), 3 * padded_, kFarAway);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Map<Eigen::RowVectorXf>(targets_.data() + axis * padded_, count) = inducing_.row(axis);
  }
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

/// `weights`: outputs x inducing points.
DenseLayer DisplacementPrior::layerOf(const Eigen::MatrixXf& weights) const {
  Layer layer{Eigen::MatrixXf::Zero(weights.rows(), padded_),
              Eigen::VectorXf::Zero(weights.rows())};
  layer.weight.leftCols(weights.cols()) = weights;
  return {kernels_, layer, Activation::kNone};
}

/// The layer's outputs for the covariances of points with inducing points, block by block: calls
/// use(first point, outputs x count).
template <class Use>
void DisplacementPrior::multiply(const DenseLayer& layer, const Points& points, ThreadTeam& team,
                                 const Use& use) const {
  const auto outputs = static_cast<long>(layer.paddedOutputs());
  std::vector<AlignedFloats> covariances, products;
  for (int thread = 0; thread < team.size(); ++thread) {
    covariances.emplace_back(static_cast<std::size_t>(kBlock * padded_));
    products.emplace_back(static_cast<std::size_t>(kBlock * outputs));
  }
  const float* const targets[] = {targets_.data(), targets_.data() + padded_,
                                  targets_.data() + 2 * padded_};
  team.forEach((points.cols() + kBlock - 1) / kBlock, [&](int thread, long block) {
    const Eigen::Index first = block * kBlock, count = std::min(kBlock, points.cols() - first);
    float* covariance = covariances[static_cast<std::size_t>(thread)].data();
    float* product = products[static_cast<std::size_t>(thread)].data();
    kernels_.gaussians(points.data() + 3 * first, count, targets, padded_, exponent_, covariance);
    kernels_.dense(layer.view(), {covariance, padded_, count}, 0, layer.view().panel_count, product,
                   outputs);
    use(first, Eigen::Map<const Eigen::MatrixXf>(product, outputs, count));
  });
}

Eigen::MatrixXf DisplacementPrior::functions(const Points& points) const {
  ThreadTeam alone(1);
  return functions(points, alone);
}

Eigen::MatrixXf DisplacementPrior::functions(const Points& points, ThreadTeam& team) const {
  Eigen::MatrixXf functions(rank(), points.cols());
  multiply(layerOf(weights_.transpose()), points, team, [&](Eigen::Index first, const auto& rows) {
    functions.middleCols(first, rows.cols()) = rows.topRows(rank());
  });
  return functions;
}

Points DisplacementPrior::displacements(const Points& points,
                                        const Eigen::Matrix3Xf& coefficients) const {
  ThreadTeam alone(1);
  Points displacements(3, points.cols());
  multiply(layerOf(coefficients * weights_.transpose()), points, alone,
           [&](Eigen::Index first, const auto& rows) {
             displacements.middleCols(first, rows.cols()) = rows.template topRows<3>();
           });
  return displacements;
}

/// The derivative of exp(e |p - z|^2) is 2 e exp(e |p - z|^2) (p - z)^T.
std::vector<Eigen::Matrix3f> DisplacementPrior::gradients(
    const Points& points, const Eigen::Matrix3Xf& coefficients) const {
  const Eigen::Matrix3Xf weights = coefficients * weights_.transpose();
  Eigen::MatrixXf sums(12, weights.cols());  // of the displacements, and weight z^T by columns
  sums.topRows<3>() = weights;
  for (int axis = 0; axis < 3; ++axis) {
    sums.middleRows<3>(3 + 3 * axis) = weights.array().rowwise() * inducing_.row(axis).array();
  }
  ThreadTeam alone(1);
  std::vector<Eigen::Matrix3f> gradients(static_cast<std::size_t>(points.cols()));
  multiply(layerOf(sums), points, alone, [&](Eigen::Index first, const auto& rows) {
    for (Eigen::Index i = 0; i < rows.cols(); ++i) {
      const Eigen::Vector3f displacement = rows.col(i).template head<3>();
      const Eigen::Map<const Eigen::Matrix3f> moments(rows.col(i).data() + 3);
      gradients[static_cast<std::size_t>(first + i)] =
          2.0F * exponent_ * (displacement * points.col(first + i).transpose() - moments);
    }
  });
  return gradients;
}

}  // namespace unirit
