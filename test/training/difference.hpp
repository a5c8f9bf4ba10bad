// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "unirit/network/weights.hpp"

namespace unirit::training {

/// Largest of any two weights.
inline double difference(const Weights& a, const Weights& b) {
  double largest = 0.0;
  for (const auto& [name, layer] : a.layers) {
    const double change = (layer.weight - b.layers.at(name).weight).cwiseAbs().maxCoeff();
    largest = std::max(largest, change);
  }
  return largest;
}

}  // namespace unirit::training
