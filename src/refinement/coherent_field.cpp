// SPDX-License-Identifier: BSD-3-Clause
#include "coherent_field.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace unirit {
namespace {

constexpr Eigen::Index kBlock = 192;  // points evaluated together, to stay in the cache

/// Covariance of the coefficients that the cloud took away, summed over the axes, and below it the
/// coefficients.
Layer productsOf(const Eigen::MatrixXf& covariance_factor, const Eigen::Matrix3Xf& coefficients) {
  const Eigen::Index rank = coefficients.cols();
  Eigen::MatrixXf learnt = 3.0F * Eigen::MatrixXf::Identity(rank, rank);
  for (int axis = 0; axis < 3; ++axis) {
    const auto factor = covariance_factor.middleCols(axis * rank, rank);
    learnt.noalias() -= factor.transpose() * factor;
  }
  Layer layer{Eigen::MatrixXf(rank + 3, rank), Eigen::VectorXf::Zero(rank + 3)};
  layer.weight << learnt, coefficients;
  return layer;
}

}  // namespace

CoherentField::CoherentField(std::shared_ptr<const DisplacementPrior> prior,
                             const Normalisation& normalisation, const Eigen::Matrix3f& rotation,
                             const Eigen::Matrix3Xf& coefficients,
                             const Eigen::MatrixXf& covariance_factor)
    : prior_(std::move(prior)),
      normalisation_(normalisation),
      coefficients_(normalisation.scale * rotation * coefficients),
      kernels_(selectKernels()),
      product_(kernels_, productsOf(covariance_factor, coefficients_), Activation::kNone) {}

Points CoherentField::displacements(const Points& preoperative) const {
  return prior_->displacements(normalisation_.apply(preoperative), coefficients_);
}

std::vector<Eigen::Matrix3f> CoherentField::gradients(const Points& preoperative) const {
  return prior_->gradients(normalisation_.apply(preoperative),
                           coefficients_ / normalisation_.scale);
}

Eigen::RowVectorXf CoherentField::confidence(const Points& preoperative) const {
  ThreadTeam alone(1);
  return valuesAt(prior_->functions(normalisation_.apply(preoperative)), alone).confidence;
}

float CoherentField::priorDeviation() const {
  return normalisation_.scale * std::sqrt(3.0F * prior_->variance());
}

FieldValues CoherentField::valuesAt(const Eigen::MatrixXf& functions, ThreadTeam& team) const {
  const Eigen::Index rank = functions.rows(), total = functions.cols();
  const auto outputs = static_cast<Eigen::Index>(product_.paddedOutputs());
  std::vector<AlignedFloats> products;
  for (int thread = 0; thread < team.size(); ++thread) {
    products.emplace_back(static_cast<std::size_t>(kBlock * outputs));
  }
  FieldValues values{Points(3, total), Eigen::RowVectorXf(total)};
  team.forEach((total + kBlock - 1) / kBlock, [&](int thread, long block) {
    const Eigen::Index first = block * kBlock, count = std::min(kBlock, total - first);
    const auto known = functions.middleCols(first, count);
    float* product = products[static_cast<std::size_t>(thread)].data();
    kernels_.dense(product_.view(), {known.data(), rank, count}, 0, product_.view().panel_count,
                   product, outputs);
    const Eigen::Map<const Eigen::MatrixXf> rows(product, outputs, count);
    values.displacements.middleCols(first, count) = rows.middleRows<3>(rank);
    auto confidence = values.confidence.segment(first, count);
    confidence = rows.topRows(rank).cwiseProduct(known).colwise().sum();
    confidence = (confidence.array() / (3.0F * prior_->variance())).max(0.0F).min(1.0F);
  });
  return values;
}

}  // namespace unirit
