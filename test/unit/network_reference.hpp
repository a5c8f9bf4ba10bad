// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

#include "flow_reference.hpp"
#include "unirit/random.hpp"

/// The network as network.hpp describes it, layer by layer in double precision and without any
/// saving: what the fast one is held against.
namespace unirit::reference {

/// The accumulated transform after each iteration.
inline std::vector<Eigen::Isometry3d> estimateRigid(const Weights& weights,
                                                    const Points& source_points,
                                                    const Points& target_points, int iterations) {
  const bool by_flow = weights.pairing == Pairing::kOffsets;
  std::vector<Eigen::Isometry3d> iterates;
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  for (int left = iterations; left > 0;) {
    const bool coarse = by_flow && left > 1;
    const auto read = [&](const Points& points) -> Eigen::Matrix3Xd {
      if (!by_flow) return points.cast<double>();
      return evenly(points, coarse ? kFlowCoarsePoints : points.cols()).cast<double>();
    };
    const Eigen::Matrix3Xd source = read(source_points), target = read(target_points);
    const Eigen::Matrix3Xd moved = transform * source;
    Eigen::Isometry3d step;
    if (by_flow) {
      MovingCloud cloud(moved), none(Eigen::Matrix3Xd(3, 0));
      followFlow(weights, coarse ? kFlowCoarseSteps : kFlowFineSteps, cloud, target, none);
      step = Eigen::umeyama(cloud.start, cloud.reached, false);
    } else {
      const Eigen::VectorXd pose =
          decode(weights, "rigid.decoder", features(weights, "rigid", moved, target));
      const Eigen::Quaterniond rotation(pose[0], pose[1], pose[2], pose[3]);
      step = Eigen::Translation3d(pose.tail<3>()) * rotation.normalized();
    }
    transform = step * transform;
    iterates.push_back(transform);
    const double motion = (step * moved - moved).norm() / std::sqrt(moved.cols());
    const bool converged = by_flow && motion < static_cast<double>(kFlowConverged);
    left = converged ? std::min(left - 1, 1) : left - 1;
  }
  return iterates;
}

inline Eigen::Matrix3Xd estimateDisplacements(const Weights& weights, const Points& source_points,
                                              const Points& target_points,
                                              const Points& query_points) {
  const Eigen::Matrix3Xd source = source_points.cast<double>();
  const Eigen::Matrix3Xd queries = query_points.cast<double>();
  const Eigen::Matrix3Xd target = target_points.cast<double>();
  if (weights.pairing == Pairing::kOffsets) {
    MovingCloud cloud(source), moving_queries(queries);
    const Points sorted = evenly(target_points, target_points.cols());
    followFlow(weights, kFlowNonRigidSteps, cloud, sorted.cast<double>(), moving_queries);
    return moving_queries.reached - queries;
  }
  const Eigen::VectorXd both = features(weights, "nonrigid", source, target);
  Eigen::MatrixXd inputs(nonRigidDecoderInputs(weights.pairing), queries.cols());
  inputs.topRows(3) = queries;
  inputs.middleRows(3, both.size()).colwise() = both;
  if (weights.pairing == Pairing::kRow) inputs.bottomRows(3) = target;
  if (weights.pairing == Pairing::kNearest) inputs.bottomRows(3) = offsets(queries, target);
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
  if (pairing == Pairing::kOffsets) {  // whose steps, random ones, must not run away
    weights->layers.at("flow.decoder.3").bias *= 0.5F;
  } else {
    weights->layers.at("nonrigid.decoder.5").weight *= 20.0F;
  }
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

/// Points on an ellipsoid: normals that no rounding turns.
inline Points surfacePoints(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  Points points(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    points.col(i) = random.direction().cwiseProduct(Eigen::Vector3d(0.5, 0.35, 0.25)).cast<float>();
  }
  return points;
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
