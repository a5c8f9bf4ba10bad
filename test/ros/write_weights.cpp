// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <exception>

#include "unirit/network/weights.hpp"

/// Writes untrained weights that move and displace the organ a little: enough for the node's
/// behaviour to be tested.
int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    unirit::Weights weights = unirit::randomWeights(unirit::NetworkSettings().pairing, 1);
    weights.layers.at("flow.decoder.3").weight *= 0.02F;
    unirit::writeWeights(weights, argv[1]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
