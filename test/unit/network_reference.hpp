// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "unirit/network/network.hpp"
#include "unirit/random.hpp"

/// The network as network.hpp describes it, layer by layer in double precision and without any
/// saving: what the fast one is held against.
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

/// From each point to the nearest of the others.
inline Eigen::Matrix3Xd offsets(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& others) {
  Eigen::Matrix3Xd offsets(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    Eigen::Index nearest = 0;
    (others.colwise() - points.col(i)).colwise().squaredNorm().minCoeff(&nearest);
    offsets.col(i) = others.col(nearest) - points.col(i);
  }
  return offsets;
}

inline Eigen::VectorXd encode(const Weights& weights, const std::string& name,
                              const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& others) {
  Eigen::MatrixXd values(weights.layers.at(name + ".0").weight.cols(), points.cols());
  values.topRows(3) = points;
  if (values.rows() == kOffsetInputs) values.bottomRows(3) = offsets(points, others);
  for (int i = 0; i < 5; ++i) {
    values = dense(weights, name + "." + std::to_string(i), values, true);
  }
  return values.rowwise().maxCoeff();
}

inline Eigen::VectorXd features(const Weights& weights, const std::string& module,
                                const Eigen::Matrix3Xd& source, const Eigen::Matrix3Xd& target) {
  const auto of_source = encode(weights, module + ".source_encoder", source, target),
             of_target = encode(weights, module + ".target_encoder", target, source);
  Eigen::VectorXd both(of_source.size() + of_target.size());
  both << of_source, of_target;
  return both;
}

/// The accumulated transform after each iteration.
inline std::vector<Eigen::Isometry3d> estimateRigid(const Weights& weights, const Points& source,
                                                    const Points& target, int iterations) {
  std::vector<Eigen::Isometry3d> iterates;
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  for (int i = 0; i < iterations; ++i) {
    const bool coarse = i < coarseIterations(weights.pairing, iterations);
    const std::string module = coarse ? "rigid" : "fine";
    const Eigen::Matrix3Xd moved = transform * source.cast<double>();
    const Eigen::VectorXd pose = decode(weights, module + ".decoder",
                                        features(weights, module, moved, target.cast<double>()));
    const Eigen::Quaterniond rotation(pose[0], pose[1], pose[2], pose[3]);
    const Eigen::Isometry3d step = Eigen::Translation3d(pose.tail<3>()) * rotation.normalized();
    transform = step * transform;
    iterates.push_back(transform);
  }
  return iterates;
}

inline Eigen::Matrix3Xd estimateDisplacements(const Weights& weights, const Points& source,
                                              const Points& target, const Points& queries) {
  const Eigen::VectorXd both =
      features(weights, "nonrigid", source.cast<double>(), target.cast<double>());
  Eigen::MatrixXd inputs(nonRigidDecoderInputs(weights.pairing), queries.cols());
  inputs.topRows(3) = queries.cast<double>();
  inputs.middleRows(3, both.size()).colwise() = both;
  if (weights.pairing == Pairing::kRow) {
    inputs.bottomRows(3) = target.cast<double>();
  } else if (weights.pairing != Pairing::kNone) {
    inputs.bottomRows(3) = offsets(queries.cast<double>(), target.cast<double>());
  }
  return decode(weights, "nonrigid.decoder", inputs);
}

/// Random weights whose every bias counts and whose outputs are large enough to show an error.
inline std::shared_ptr<const Weights> makeLoudWeights(Pairing pairing) {
  auto weights = std::make_shared<Weights>(randomWeights(pairing, 11));
  Random random(12);
  for (auto& [name, layer] : weights->layers) {
    for (Eigen::Index k = 0; k < layer.bias.size(); ++k) {
      layer.bias[k] += static_cast<float>(0.1 * random.normal());
    }
  }
  weights->layers.at("nonrigid.decoder.5").weight *= 20.0F;
  return weights;
}

/// The same, made once for each pairing.
inline std::shared_ptr<const Weights> loudWeights(Pairing pairing) {
  static std::map<Pairing, std::shared_ptr<const Weights>> made;
  auto& weights = made[pairing];
  if (!weights) {
    weights = makeLoudWeights(pairing);
  }
  return weights;
}

inline Points randomPoints(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  return Points::NullaryExpr(3, count, [&] { return static_cast<float>(random.uniform(-1, 1)); });
}

/// A permutation of 0 .. count - 1.
inline std::vector<Eigen::Index> shuffled(Eigen::Index count, std::uint64_t seed) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  Random random(seed);
  for (std::size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.below(static_cast<long>(i)))]);
  }
  return order;
}

}  // namespace unirit::reference
