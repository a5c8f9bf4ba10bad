// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "unirit/network/architecture.hpp"

namespace unirit {

/// One fully connected layer: y = weight x + bias.
struct Layer {
  Eigen::MatrixXf weight;  ///< outputs x inputs
  Eigen::VectorXf bias;    ///< outputs
};

/// The trained network as it stands in a file.
struct Weights {
  Pairing pairing = Pairing::kNearest;
  std::map<std::string, Layer> layers;          ///< by the names of layerShapes
  std::map<std::string, std::string> metadata;  ///< architecture, training data, metrics, ...
  std::string sha256;                           ///< of the file's bytes
};

/// Throws std::invalid_argument where a layer of the architecture is missing, misshapen or holds a
/// value that is not finite, or where there is a layer too many.
void validate(const Weights& weights);

/// Reads a safetensors file (F16 or F32) of this architecture. Throws std::runtime_error with a
/// sentence that names the file and what is wrong with it: missing, truncated, not safetensors, a
/// tensor missing, unknown, of wrong shape or type, or holding a value that is not finite.
Weights readWeights(const std::string& path);

/// Writes half precision safetensors, atomically (a file of that name is never half written).
/// Throws std::runtime_error where the file cannot be written, std::invalid_argument as validate
/// does and where a value does not fit in half precision.
void writeWeights(const Weights& weights, const std::string& path);

/// He-initialised weights (Kaiming normal, zero biases), last layers scaled by 0.05, that of the
/// flow by 0.005, the rigid decoder's last bias a unit quaternion: starts near the identity. What
/// the non-rigid decoder reads of one point counts as much as both clouds' features together,
/// offsets taken to be a tenth as long as points. For tests and training.
Weights randomWeights(Pairing pairing, unsigned seed);

}  // namespace unirit
