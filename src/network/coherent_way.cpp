// SPDX-License-Identifier: BSD-3-Clause
#include "coherent_way.hpp"

#include <cmath>
#include <stdexcept>

#include "unirit/network/architecture.hpp"

namespace unirit {
void CoherentWay::fit(const Points& points, const Points& offsets, const Points& normals) {
  constexpr float kSquaredAmplitude = kFlowAmplitude * kFlowAmplitude;
  constexpr float kSquaredRigid = kFlowRigidAmplitude * kFlowRigidAmplitude;
  constexpr float kSquaredNoise = kFlowPlaneNoise * kFlowPlaneNoise;
  constexpr float kSquaredReach = kFlowPlaneReach * kFlowPlaneReach;
  constexpr float kExponent = -0.5F / (kFlowLength * kFlowLength);
  const Eigen::Index count = points.cols();
  wrenches_.resize(6, count);
  gains_.resize(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Eigen::Vector3f point = points.col(j), normal = normals.col(j);
    wrenches_.col(j).head<3>() = normal;
    wrenches_.col(j).tail<3>() = point.cross(normal);
    gains_[j] = normal.dot(offsets.col(j));
  }

  covariance_.resize(count, count);
  covariance_.triangularView<Eigen::Lower>() =
      kSquaredRigid * wrenches_.transpose().lazyProduct(wrenches_);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Eigen::Index rest = count - j;
    const Eigen::Vector3f point = points.col(j), normal = normals.col(j);
    covariance_.col(j).tail(rest).array() +=
        kSquaredAmplitude *
        (kExponent * (points.rightCols(rest).colwise() - point).colwise().squaredNorm().transpose())
            .array()
            .exp() *
        (normals.rightCols(rest).transpose().lazyProduct(normal)).array();
    covariance_(j, j) *= 1.0F + kFlowPlaneRounding;
    covariance_(j, j) += kSquaredNoise * (1.0F + offsets.col(j).squaredNorm() / kSquaredReach);
  }
  factor_.compute(covariance_);
  if (factor_.info() != Eigen::Success) {
    throw std::runtime_error("the target's planes give no coherent motion of the source");
  }
  factor_.solveInPlace(gains_);

  const Eigen::Matrix<float, 6, 1> motion = kSquaredRigid * wrenches_.lazyProduct(gains_);
  translation_ = motion.head<3>();
  turn_ = motion.tail<3>();
  sources_.resize(3, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    sources_.col(j) = kSquaredAmplitude * gains_[j] * normals.col(j);
  }
}

}  // namespace unirit
