// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <benchmark/benchmark.h>

#include <memory>

#include "unirit/network/network.hpp"
#include "unirit/random.hpp"

/// What all measurements share: one pair of clouds of 1024 points, one seed of weights.
namespace unirit::speed {

inline constexpr Eigen::Index kPoints = 1024;
inline constexpr Eigen::Index kVertices = 20000;
inline constexpr int kRigidIterations = 8;

inline Points randomPoints(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  return Points::NullaryExpr(3, count, [&] { return static_cast<float>(random.uniform(-1, 1)); });
}

inline const Points& source() {
  static const Points points = randomPoints(kPoints, 1);
  return points;
}

inline const Points& target() {
  static const Points points = randomPoints(kPoints, 2);
  return points;
}

/// Speed does not depend on the weights' values, but the flow must never seem to have arrived.
inline std::shared_ptr<const Weights> weights(Pairing pairing) {
  Weights weights = randomWeights(pairing, 1);
  if (pairing == Pairing::kOffsets) weights.layers.at("flow.decoder.3").bias[0] = 0.1F;
  return std::make_shared<const Weights>(std::move(weights));
}

inline int threadsOf(const benchmark::State& state) { return static_cast<int>(state.range(0)); }

/// Shows the rate that `multiply_adds` an iteration make.
inline void setRate(benchmark::State& state, double multiply_adds) {
  state.counters["GFLOP/s"] =
      benchmark::Counter(2e-9 * multiply_adds, benchmark::Counter::kIsIterationInvariantRate);
}

/// Of the whole network.
inline double forwardMultiplyAdds(Pairing pairing) {
  return multiplyAdds(kPoints, kPoints, kRigidIterations, pairing, true);
}

}  // namespace unirit::speed
