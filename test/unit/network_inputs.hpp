// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "unirit/network/network.hpp"
#include "unirit/random.hpp"

/// Weights and clouds to try the network with.
namespace unirit::test {

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

}  // namespace unirit::test
