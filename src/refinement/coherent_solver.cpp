// SPDX-License-Identifier: BSD-3-Clause
#include "coherent_solver.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace unirit {
namespace {

constexpr long kProductRows = 12;  // rows multiplied by one thread at a time: a register tile
/// Rows and columns of a symmetric 3 x 3 matrix's six entries; which entry stands where.
constexpr std::array<std::pair<int, int>, 6> kEntries{
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};
constexpr int kEntryAt[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

Eigen::Vector3f rotationVector(const Eigen::Matrix3f& rotation) {
  const Eigen::AngleAxisf angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

Eigen::Matrix3f rotationOf(const Eigen::Vector3f& vector) {
  const float angle = vector.norm();
  if (angle == 0.0F) return Eigen::Matrix3f::Identity();
  return Eigen::AngleAxisf(angle, vector / angle).toRotationMatrix();
}

}  // namespace

CoherentSolver::CoherentSolver(const Points& source, const Eigen::MatrixXf& functions,
                               const PosePrior& prior, const Kernels& kernels, ThreadTeam& team)
    : source_(source),
      functions_(functions),
      prior_(prior),
      deviations_(prior),
      kernels_(kernels),
      team_(team),
      product_(kernels, {functions, Eigen::VectorXf::Zero(functions.rows())}, Activation::kNone),
      displacement_(kernels, {functions.transpose(), Eigen::VectorXf::Zero(functions.cols())},
                    Activation::kNone),
      rows_(gradientRow(3), source.cols()),
      products_(rows_.rows(), static_cast<Eigen::Index>(product_.paddedOutputs())),
      information_(6, source.cols()),
      coefficients_(3, rank()),
      displaced_(3, static_cast<Eigen::Index>(displacement_.paddedOutputs())),
      matrix_(3 * rank() + kPose, 3 * rank() + kPose),
      unknowns_(3 * rank() + kPose),
      factor_(kernels) {}

/// Each point's information matrix and gradient, and the parts of the normal equations that hold
/// the pose. Residuals count from the reference, pose columns from where points lie now.
void CoherentSolver::weigh(const Correspondences& correspondences, const Trust& trust,
                           const CoherentState& state, const PointRows<3>& reference) {
  const Eigen::Matrix3f to_source = state.pose.linear().transpose();
  const Eigen::Vector3f shift = to_source * state.pose.translation();
  const float along = 1.0F / (trust.along * trust.along);
  const float across = 1.0F / (trust.across * trust.across);
  normals_.matrix() = to_source.lazyProduct(correspondences.normals);
  residuals_.matrix() = to_source.lazyProduct(correspondences.positions);
  residuals_ -= reference.colwise() + shift.array();
  weights_ = trust.weight * correspondences.mass.array().min(1.0F);
  for (int entry = 0; entry < 6; ++entry) {
    const auto [row, column] = kEntries[static_cast<std::size_t>(entry)];
    information_.row(entry) =
        (along - across) * weights_ * normals_.row(row) * normals_.row(column);
    if (row == column) information_.row(entry) += across * weights_;
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto information = [&](int column) { return information_.row(kEntryAt[axis][column]); };
    rows_.row(gradientRow(axis)).array() = information(0) * residuals_.row(0) +
                                           information(1) * residuals_.row(1) +
                                           information(2) * residuals_.row(2);
  }
  weighPose();
}

/// The pose moves a point by rotation x point + translation.
void CoherentSolver::weighPose() {
  const auto moment = [&](int axis, const auto& force) {
    const int next = (axis + 1) % 3, last = (axis + 2) % 3;
    return moved_.row(next) * force(last) - moved_.row(last) * force(next);
  };
  const auto gradient = [&](int axis) { return rows_.row(gradientRow(axis)).array(); };
  for (int i = 0; i < 3; ++i) {
    const auto information = [&](int axis) { return information_.row(kEntryAt[i][axis]); };
    for (int axis = 0; axis < 3; ++axis) {
      rows_.row(poseRow(i, axis)) = moment(axis, information);
      rows_.row(poseRow(i, 3 + axis)) = information(axis);
    }
  }
  for (int i = 0; i < 3; ++i) {
    const auto column = [&](int axis) { return rows_.row(poseRow(axis, i)).array(); };
    for (int axis = 0; axis < 3; ++axis) {
      pose_matrix_(axis, i) = moment(axis, column).sum();
      pose_matrix_(3 + axis, i) = pose_matrix_(i, 3 + axis) = column(axis).sum();
      pose_matrix_(3 + axis, 3 + i) = information_.row(kEntryAt[i][axis]).sum();
    }
    pose_gradient_[i] = moment(i, gradient).sum();
    pose_gradient_[3 + i] = gradient(i).sum();
  }
}

/// Of the products of these rows: a symmetric block is computed up to its diagonal.
long CoherentSolver::panelsOf(long first, long end) const {
  const long below = first % rank() + (end - first);
  if (end > 6 * rank() || below > rank()) return product_.view().panel_count;
  return (below + kernels_.panel_width - 1) / kernels_.panel_width;
}

/// Every weighted row times every function: all inner products that the normal equations need.
void CoherentSolver::multiply() {
  const long items = (rows_.rows() + kProductRows - 1) / kProductRows;
  team_.forEach(items, [&](int, long item) {
    const long first = item * kProductRows, end = std::min(first + kProductRows, rows_.rows());
    for (long row = first; row < std::min(end, 6 * rank()); ++row) {
      rows_.row(row).array() =
          functions_.row(row % rank()).array() * information_.row(row / rank());
    }
    const RowsView input{rows_.data() + first * rows_.cols(), rows_.cols(), end - first};
    kernels_.dense(product_.view(), input, 0, panelsOf(first, end),
                   products_.data() + first * products_.cols(), products_.cols());
  });
}

void CoherentSolver::assemble() {
  const Eigen::Index r = rank();
  for (std::size_t entry = 0; entry < kEntries.size(); ++entry) {
    const auto [row, column] = kEntries[entry];
    const auto product = products_.block(static_cast<Eigen::Index>(entry) * r, 0, r, r);
    auto block = matrix_.block(column * r, row * r, r, r);
    block.triangularView<Eigen::Lower>() = product;
    block.triangularView<Eigen::StrictlyUpper>() = product.transpose();
  }
  for (int axis = 0; axis < 3; ++axis) {
    matrix_.block(3 * r, axis * r, kPose, r) = products_.block(poseRow(axis, 0), 0, kPose, r);
    unknowns_.segment(axis * r, r) = products_.row(gradientRow(axis)).head(r).transpose();
  }
  matrix_.diagonal().head(3 * r).array() += 1.0F;  // the prior's coefficients are standard normal
  matrix_.bottomRightCorner<kPose, kPose>() = pose_matrix_;
  unknowns_.tail<kPose>() = pose_gradient_;
}

void CoherentSolver::addPosePrior(const CoherentState& state, Eigen::Index first) {
  const float rotation = 1.0F / (deviations_.rotation * deviations_.rotation);
  const float translation = 1.0F / (deviations_.translation * deviations_.translation);
  const Eigen::Matrix3f to_source = state.pose.linear().transpose();
  matrix_.diagonal().segment<3>(first).array() += rotation;
  matrix_.diagonal().segment<3>(first + 3).array() += translation;
  unknowns_.segment<3>(first) -= rotation * rotationVector(state.pose.linear());
  unknowns_.segment<3>(first + 3) -= translation * (to_source * state.pose.translation());
}

void CoherentSolver::movePose(Eigen::Index first, CoherentState& state) const {
  state.pose.translation() += state.pose.linear() * unknowns_.segment<3>(first + 3);
  const Eigen::Quaternionf turned(state.pose.linear() * rotationOf(unknowns_.segment<3>(first)));
  state.pose.linear() = turned.normalized().toRotationMatrix();
}

/// The deviations that make pose and its posterior variance most likely; the prior counts as one
/// further observation of each.
void CoherentSolver::learnDeviations(const CoherentState& state) {
  const Eigen::Matrix<float, kPose, kPose> corner =
      factor_.matrixL().bottomRightCorner<kPose, kPose>();
  const Eigen::Matrix<float, kPose, kPose> inverse =
      corner.triangularView<Eigen::Lower>().solve(Eigen::Matrix<float, kPose, kPose>::Identity());
  const Eigen::Matrix<float, 1, kPose> variances = inverse.colwise().squaredNorm();
  const auto learn = [](float prior, const Eigen::Vector3f& value, float variance) {
    return std::sqrt((prior * prior + value.squaredNorm() + variance) / 4.0F);
  };
  deviations_.rotation =
      learn(prior_.rotation, rotationVector(state.pose.linear()), variances.head<3>().sum());
  deviations_.translation =
      learn(prior_.translation, state.pose.translation(), variances.tail<3>().sum());
}

void CoherentSolver::solvePose(const Correspondences& correspondences, const Trust& trust,
                               CoherentState& state) {
  moved_ = source_ + state.displacements.array();
  weigh(correspondences, trust, state, moved_);
  matrix_.topLeftCorner<kPose, kPose>() = pose_matrix_;
  unknowns_.head<kPose>() = pose_gradient_;
  addPosePrior(state, 0);
  const Eigen::Matrix<float, kPose, kPose> matrix = matrix_.topLeftCorner<kPose, kPose>();
  unknowns_.head<kPose>() = matrix.llt().solve(unknowns_.head<kPose>()).eval();
  movePose(0, state);
}

void CoherentSolver::solve(const Correspondences& correspondences, const Trust& trust,
                           CoherentState& state, float stride) {
  moved_ = source_ + state.displacements.array();
  weigh(correspondences, trust, state, source_);
  multiply();
  assemble();
  const Eigen::Index pose = 3 * rank();
  addPosePrior(state, pose);
  factor_.compute(matrix_);
  factor_.solveInPlace(unknowns_);
  for (int axis = 0; axis < 3; ++axis) {
    auto coefficients = state.coefficients.row(axis);
    coefficients += stride * (unknowns_.segment(axis * rank(), rank()).transpose() - coefficients);
  }
  displace(state);
  unknowns_.tail<kPose>() *= stride;
  movePose(pose, state);
  learnDeviations(state);
}

void CoherentSolver::displace(CoherentState& state) {
  coefficients_ = state.coefficients;
  const RowsView input{coefficients_.data(), coefficients_.cols(), coefficients_.rows()};
  kernels_.dense(displacement_.view(), input, 0, displacement_.view().panel_count,
                 displaced_.data(), displaced_.cols());
  state.displacements = displaced_.leftCols(source_.cols());
}

void CoherentSolver::covarianceFactor(Eigen::MatrixXf& factor) const {
  factor.setIdentity(matrix_.rows(), 3 * rank());
  factor_.matrixL().triangularView<Eigen::Lower>().solveInPlace(factor);
}

}  // namespace unirit
