// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "refinement/coherent_solver.hpp"

/// The maximisation step as coherent_solver.hpp describes it, as one dense system in double
/// precision: what the fast one is held against.
namespace unirit::reference {

struct State {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Matrix3Xd coefficients;
};

struct Deviations {
  double rotation;
  double translation;
};

/// Observations of one source point: what it explains, how much it is trusted.
struct Observations {
  Eigen::Matrix3Xd source, positions, normals;
  Eigen::VectorXd mass;
  double along, across, weight;
};

inline Eigen::Vector3d rotationVector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd angle_axis(rotation);
  return angle_axis.angle() * angle_axis.axis();
}

inline Eigen::Matrix3d crossProduct(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

/// Coefficients axis by axis, then the pose's step: its normal equations.
struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;

  Eigen::MatrixXd covariance() const {
    return matrix.ldlt().solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
  }
};

/// `moved`: 3 x N, where the points lie in the source's frame, about which rotations turn.
inline NormalEquations normalEquations(const Observations& seen, const Eigen::MatrixXd& functions,
                                       const Eigen::Matrix3Xd& moved, const State& state,
                                       const Deviations& deviations) {
  const Eigen::Index rank = functions.rows(), size = 3 * rank + 6;
  NormalEquations equations{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  const Eigen::Matrix3d back = state.rotation.transpose();
  for (Eigen::Index i = 0; i < seen.source.cols(); ++i) {
    Eigen::MatrixXd row = Eigen::MatrixXd::Zero(3, size);
    for (int axis = 0; axis < 3; ++axis) {
      row.block(axis, axis * rank, 1, rank) = functions.col(i).transpose();
    }
    row.block<3, 3>(0, 3 * rank) = -crossProduct(moved.col(i));
    row.block<3, 3>(0, 3 * rank + 3).setIdentity();
    const Eigen::Vector3d normal = back * seen.normals.col(i);
    const Eigen::Matrix3d along = normal * normal.transpose();
    const Eigen::Matrix3d information =
        seen.weight * std::min(seen.mass[i], 1.0) *
        (along / (seen.along * seen.along) +
         (Eigen::Matrix3d::Identity() - along) / (seen.across * seen.across));
    const Eigen::Vector3d residual =
        back * (seen.positions.col(i) - state.translation) - seen.source.col(i);
    equations.matrix += row.transpose() * information * row;
    equations.right += row.transpose() * information * residual;
  }
  equations.matrix.diagonal().head(3 * rank).array() += 1.0;
  const double rotation = std::pow(deviations.rotation, -2.0),
               translation = std::pow(deviations.translation, -2.0);
  equations.matrix.diagonal().segment<3>(3 * rank).array() += rotation;
  equations.matrix.diagonal().tail<3>().array() += translation;
  equations.right.segment<3>(3 * rank) -= rotation * rotationVector(state.rotation);
  equations.right.tail<3>() -= translation * (back * state.translation);
  return equations;
}

inline void solve(const NormalEquations& equations, State& state) {
  const Eigen::Index rank = (equations.right.size() - 6) / 3;
  const Eigen::VectorXd unknowns = equations.matrix.ldlt().solve(equations.right);
  state.coefficients.resize(3, rank);
  for (int axis = 0; axis < 3; ++axis) {
    state.coefficients.row(axis) = unknowns.segment(axis * rank, rank).transpose();
  }
  const Eigen::Vector3d turn = unknowns.segment<3>(3 * rank);
  state.translation += state.rotation * unknowns.tail<3>();
  state.rotation = state.rotation * Eigen::AngleAxisd(turn.norm(), turn.normalized());
}

/// Most likely deviations given the pose and its covariance, the prior's as a fourth observation.
inline Deviations learnt(const NormalEquations& equations, const State& state,
                         const PosePrior& prior) {
  const Eigen::MatrixXd covariance = equations.covariance().bottomRightCorner<6, 6>();
  const auto learn = [](double before, const Eigen::Vector3d& value, double variance) {
    return std::sqrt((before * before + value.squaredNorm() + variance) / 4.0);
  };
  return {learn(static_cast<double>(prior.rotation), rotationVector(state.rotation),
                covariance.diagonal().head<3>().sum()),
          learn(static_cast<double>(prior.translation), state.translation,
                covariance.diagonal().tail<3>().sum())};
}

}  // namespace unirit::reference
