// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "displacement_prior.hpp"
#include "unirit/deformation.hpp"
#include "unirit/network/network.hpp"

namespace unirit {

/// The displacement that a refinement found, in metres and in the intra-operative frame.
class CoherentField : public DisplacementField {
 public:
  /// `coefficients`: 3 x rank, in the prior's frame and unit; `covariance_factor`:
  /// CoherentSolver::covarianceFactor; `rotation`: pre-operative to intra-operative.
  CoherentField(std::shared_ptr<const DisplacementPrior> prior, const Normalisation& normalisation,
                const Eigen::Matrix3f& rotation, const Eigen::Matrix3Xf& coefficients,
                const Eigen::MatrixXf& covariance_factor);

  Points displacements(const Points& preoperative) const override;
  std::vector<Eigen::Matrix3f> gradients(const Points& preoperative) const override;
  Eigen::RowVectorXf confidence(const Points& preoperative) const override;
  float priorDeviation() const override;

  /// The same at points where the values of the prior's functions, rank x Q, are known.
  FieldValues valuesAt(const Eigen::MatrixXf& functions, ThreadTeam& team) const;

 private:
  std::shared_ptr<const DisplacementPrior> prior_;
  Normalisation normalisation_;
  Eigen::Matrix3Xf coefficients_;  // [m], intra-operative frame
  const Kernels& kernels_;
  DenseLayer product_;  // of the functions: with the covariance of the coefficients that the cloud
                        // took away, all axes; and with the coefficients
};

}  // namespace unirit
