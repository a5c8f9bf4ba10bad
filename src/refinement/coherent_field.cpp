// SPDX-License-Identifier: BSD-3-Clause
#include "coherent_field.hpp"

#include <algorithm>
#include <utility>

namespace unirit {
namespace {

constexpr Eigen::Index kBlock = 1024;  // points evaluated together, to stay in the cache

}  // namespace

CoherentField::CoherentField(std::shared_ptr<const DisplacementPrior> prior,
                             const Normalisation& normalisation, const Eigen::Matrix3f& rotation,
                             const Eigen::Matrix3Xf& coefficients,
                             const Eigen::MatrixXf& covariance_factor)
    : prior_(std::move(prior)),
      normalisation_(normalisation),
      coefficients_(normalisation.scale * rotation * coefficients) {
  const Eigen::Index rank = coefficients.cols();
  learnt_ = 3.0F * Eigen::MatrixXf::Identity(rank, rank);
  for (int axis = 0; axis < 3; ++axis) {
    const auto factor = covariance_factor.middleCols(axis * rank, rank);
    learnt_.noalias() -= factor.transpose() * factor;
  }
}

Points CoherentField::displacements(const Points& preoperative) const {
  return prior_->displacements(normalisation_.apply(preoperative), coefficients_);
}

std::vector<Eigen::Matrix3f> CoherentField::gradients(const Points& preoperative) const {
  return prior_->gradients(normalisation_.apply(preoperative),
                           coefficients_ / normalisation_.scale);
}

Eigen::RowVectorXf CoherentField::confidence(const Points& preoperative) const {
  Eigen::RowVectorXf confidence(preoperative.cols());
  for (Eigen::Index begin = 0; begin < preoperative.cols(); begin += kBlock) {
    const Eigen::Index count = std::min(kBlock, preoperative.cols() - begin);
    const Eigen::MatrixXf functions =
        prior_->functions(normalisation_.apply(preoperative.middleCols(begin, count)));
    confidence.segment(begin, count) =
        (learnt_ * functions).cwiseProduct(functions).colwise().sum() / (3.0F * prior_->variance());
  }
  return confidence.array().max(0.0F).min(1.0F);
}

}  // namespace unirit
