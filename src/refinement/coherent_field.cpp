// SPDX-License-Identifier: BSD-3-Clause
#include "coherent_field.hpp"

#include <utility>

namespace unirit {

CoherentField::CoherentField(std::shared_ptr<const DisplacementPrior> prior,
                             const Normalisation& normalisation, const Eigen::Matrix3f& rotation,
                             const Eigen::Matrix3Xf& coefficients,
                             Eigen::MatrixXf covariance_factor)
    : prior_(std::move(prior)),
      normalisation_(normalisation),
      coefficients_(normalisation.scale * rotation * coefficients),
      covariance_factor_(std::move(covariance_factor)) {}

Points CoherentField::displacements(const Points& preoperative) const {
  return prior_->displacements(normalisation_.apply(preoperative), coefficients_);
}

Eigen::RowVectorXf CoherentField::confidence(const Points& preoperative) const {
  const Eigen::MatrixXf functions = prior_->functions(normalisation_.apply(preoperative));
  const Eigen::Index rank = functions.rows();
  Eigen::RowVectorXf learnt = 3.0F * functions.colwise().squaredNorm();
  for (int axis = 0; axis < 3; ++axis) {
    learnt -=
        (covariance_factor_.middleCols(axis * rank, rank) * functions).colwise().squaredNorm();
  }
  const float before = 3.0F * prior_->variance();
  return (learnt / before).array().max(0.0F).min(1.0F);
}

}  // namespace unirit
