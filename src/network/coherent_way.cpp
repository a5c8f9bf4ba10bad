// SPDX-License-Identifier: BSD-3-Clause
#include "coherent_way.hpp"

#include <cmath>
#include <stdexcept>

#include "unirit/network/architecture.hpp"

namespace unirit {
namespace {

constexpr float kSquaredAmplitude = kFlowAmplitude * kFlowAmplitude;
constexpr float kSquaredRigid = kFlowRigidAmplitude * kFlowRigidAmplitude;
constexpr float kSquaredNoise = kFlowPlaneNoise * kFlowPlaneNoise;
constexpr float kSquaredReach = kFlowPlaneReach * kFlowPlaneReach;
constexpr float kExponent = -0.5F / (kFlowLength * kFlowLength);

}  // namespace

void CoherentWay::fit(const Points& points, const Points& offsets, const Points& normals) {
  const Eigen::Index count = points.cols();
  wrenches_.resize(count, 6);
  gains_.resize(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Eigen::Vector3f point = points.col(j), normal = normals.col(j);
    wrenches_.row(j) << normal.transpose(), point.cross(normal).transpose();
    gains_[j] = normal.dot(offsets.col(j));
  }

  findGaussians(points);
  covariance_.resize(count, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const Eigen::Index rest = count - j;
    const auto wrenches = wrenches_.bottomRows(rest);
    auto column = covariance_.col(j).tail(rest);
    column = kSquaredRigid * wrenches.lazyProduct(wrenches_.row(j).transpose());
    column.array() += kSquaredAmplitude * gaussians_.col(j).segment(j, rest).array() *
                      wrenches.leftCols<3>().lazyProduct(normals.col(j)).array();
    column[0] *= 1.0F + kFlowPlaneRounding;
    column[0] += kSquaredNoise * (1.0F + offsets.col(j).squaredNorm() / kSquaredReach);
  }
  if (!factor_.compute(covariance_)) {
    throw std::runtime_error("the target's planes give no coherent motion of the source");
  }
  factor_.solveInPlace(gains_);

  const Eigen::Matrix<float, 6, 1> motion =
      kSquaredRigid * wrenches_.transpose().lazyProduct(gains_);
  translation_ = motion.head<3>();
  turn_ = motion.tail<3>();
  sources_.resize(3, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    sources_.col(j) = kSquaredAmplitude * gains_[j] * normals.col(j);
  }
}

/// Of every two points.
void CoherentWay::findGaussians(const Points& points) {
  const Eigen::Index count = points.cols();
  const Eigen::Index padded = inWholeBlocks(count);
  coordinates_.setZero(padded, 3);
  coordinates_.topRows(count) = points.transpose();
  gaussians_.resize(padded, count);
  const float* const axes[] = {coordinates_.col(0).data(), coordinates_.col(1).data(),
                               coordinates_.col(2).data()};
  kernels_.gaussians(points.data(), count, axes, padded, kExponent, gaussians_.data());
}

}  // namespace unirit
