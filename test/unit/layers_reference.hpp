// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>

#include "unirit/network/network.hpp"

/// Layers in double precision and without any saving.
namespace unirit::reference {

inline Eigen::MatrixXd dense(const Weights& weights, const std::string& name,
                             const Eigen::MatrixXd& input, bool relu) {
  const Layer& layer = weights.layers.at(name);
  Eigen::MatrixXd output =
      (layer.weight.cast<double>() * input).colwise() + layer.bias.cast<double>();
  return relu ? Eigen::MatrixXd(output.cwiseMax(0.0)) : output;
}

inline Eigen::MatrixXd decode(const Weights& weights, const std::string& name,
                              Eigen::MatrixXd values) {
  const auto layer = [&](int i) { return name + "." + std::to_string(i); };
  for (int i = 0; weights.layers.count(layer(i)) > 0; ++i) {
    values = dense(weights, layer(i), values, weights.layers.count(layer(i + 1)) > 0);
  }
  return values;
}

inline Eigen::Index nearest(const Eigen::Vector3d& point, const Eigen::Matrix3Xd& others) {
  Eigen::Index nearest = 0;
  (others.colwise() - point).colwise().squaredNorm().minCoeff(&nearest);
  return nearest;
}

/// From each point to the nearest of the others.
inline Eigen::Matrix3Xd offsets(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& others) {
  Eigen::Matrix3Xd offsets(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    offsets.col(i) = others.col(nearest(points.col(i), others)) - points.col(i);
  }
  return offsets;
}

/// Of a column of numbers for each point.
inline Eigen::VectorXd encode(const Weights& weights, const std::string& name,
                              Eigen::MatrixXd values) {
  for (int i = 0; i < 5; ++i) {
    values = dense(weights, name + "." + std::to_string(i), values, true);
  }
  return values.rowwise().maxCoeff();
}

inline Eigen::VectorXd features(const Weights& weights, const std::string& module,
                                const Eigen::MatrixXd& source, const Eigen::MatrixXd& target) {
  const auto of_source = encode(weights, module + ".source_encoder", source),
             of_target = encode(weights, module + ".target_encoder", target);
  Eigen::VectorXd both(of_source.size() + of_target.size());
  both << of_source, of_target;
  return both;
}

}  // namespace unirit::reference
