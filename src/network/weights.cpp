// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/network/weights.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include "../atomic_file.hpp"
#include "safetensors.hpp"
#include "unirit/hash.hpp"
#include "unirit/random.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;
using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Half = Eigen::half;

constexpr char kArchitecture[] = "unirit";
constexpr std::uintmax_t kMaxFileBytes = 64U << 20U;  // twice the network in single precision
static_assert(sizeof(Half) == 2, "halves are copied as they stand in the file");

std::string readBytes(const std::string& path) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) {
    throw std::runtime_error("does not exist");
  }
  if (!fs::is_regular_file(status)) {
    throw std::runtime_error("is not a regular file");
  }
  const auto size = fs::file_size(path, error);
  if (!error && size > kMaxFileBytes) {
    throw std::runtime_error("is too large for weights of this network: " + std::to_string(size) +
                             " bytes");
  }
  std::string bytes(error ? 0 : size, '\0');
  std::ifstream stream(path, std::ios::binary);
  if (error || !stream.read(bytes.data(), static_cast<std::streamsize>(size))) {
    throw std::runtime_error("cannot be read");
  }
  return bytes;
}

std::string describe(const std::vector<std::uint64_t>& shape) {
  std::string text;
  for (const auto size : shape) {
    text += (text.empty() ? "" : ", ") + std::to_string(size);
  }
  return "[" + text + "]";
}

/// The numbers of a tensor that must have `shape`, row-major.
std::vector<float> readTensor(const TensorFile& file, const std::string& name,
                              const std::vector<std::uint64_t>& shape) {
  const auto found = file.tensors.find(name);
  if (found == file.tensors.end()) {
    throw std::runtime_error("lacks the tensor \"" + name + "\"");
  }
  const TensorView& tensor = found->second;
  if (tensor.type != "F16" && tensor.type != "F32") {
    throw std::runtime_error("holds tensor \"" + name + "\" of type " + tensor.type +
                             ", neither F16 nor F32");
  }
  if (tensor.shape != shape) {
    throw std::runtime_error("holds tensor \"" + name + "\" of shape " + describe(tensor.shape) +
                             " where the network has " + describe(shape));
  }
  std::size_t count = 1;
  for (const auto size : shape) {
    count *= size;
  }
  const bool half = tensor.type == "F16";
  if (tensor.bytes.size() != count * (half ? sizeof(Half) : sizeof(float))) {
    throw std::runtime_error("is damaged: tensor \"" + name + "\" has " +
                             std::to_string(tensor.bytes.size()) + " bytes, not what " +
                             describe(shape) + " " + tensor.type + " takes");
  }
  std::vector<float> values(count);
  if (half) {
    std::vector<Half> halves(count);
    std::memcpy(halves.data(), tensor.bytes.data(), tensor.bytes.size());
    std::transform(halves.begin(), halves.end(), values.begin(),
                   [](Half value) { return static_cast<float>(value); });
  } else {
    std::memcpy(values.data(), tensor.bytes.data(), tensor.bytes.size());
  }
  for (const float value : values) {
    if (!std::isfinite(value)) {
      throw std::runtime_error("holds a value in tensor \"" + name + "\" that is not finite");
    }
  }
  return values;
}

Pairing readPairing(const std::map<std::string, std::string>& metadata) {
  const auto architecture = metadata.find("architecture");
  if (architecture == metadata.end() || architecture->second != kArchitecture) {
    throw std::runtime_error("is of another architecture: its metadata does not say \"" +
                             std::string(kArchitecture) + "\"");
  }
  const auto pairing = metadata.find("pairing");
  if (pairing == metadata.end()) {
    throw std::runtime_error("lacks the metadata \"pairing\"");
  }
  try {
    return pairingFromString(pairing->second);
  } catch (const std::invalid_argument&) {
    throw std::runtime_error("has an unknown pairing \"" + pairing->second + "\" in its metadata");
  }
}

Weights parseWeights(const std::string& bytes) {
  TensorFile file = parseSafetensors(bytes);
  Weights weights;
  weights.pairing = readPairing(file.metadata);
  for (const LayerShape& shape : layerShapes(weights.pairing)) {
    const auto outputs = static_cast<std::uint64_t>(shape.outputs);
    const auto inputs = static_cast<std::uint64_t>(shape.inputs);
    const auto weight = readTensor(file, shape.name + ".weight", {outputs, inputs});
    const auto bias = readTensor(file, shape.name + ".bias", {outputs});
    Layer& layer = weights.layers[shape.name];
    layer.weight = Eigen::Map<const RowMajor>(weight.data(), shape.outputs, shape.inputs);
    layer.bias = Eigen::Map<const Eigen::VectorXf>(bias.data(), shape.outputs);
    file.tensors.erase(shape.name + ".weight");
    file.tensors.erase(shape.name + ".bias");
  }
  if (!file.tensors.empty()) {
    throw std::runtime_error("holds a tensor the network does not know: \"" +
                             file.tensors.begin()->first + "\"");
  }
  weights.metadata = std::move(file.metadata);
  weights.sha256 = sha256Hex(bytes);
  return weights;
}

/// Row-major halves of a matrix or vector, as bytes.
template <class Matrix>
std::string toHalfBytes(const Matrix& matrix, const std::string& name) {
  const RowMajor values = matrix;
  std::string bytes;
  bytes.reserve(sizeof(Half) * static_cast<std::size_t>(values.size()));
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const Half half(values.data()[i]);
    if (!(Eigen::numext::isfinite)(half)) {
      throw std::invalid_argument("weights: \"" + name + "\" does not fit in half precision");
    }
    bytes.append(reinterpret_cast<const char*>(&half), sizeof(half));
  }
  return bytes;
}

/// He's rule supposes inputs of one size that all say something of their own. But offsets are
/// shorter than points, and among both clouds' features what is read of one point would go unheard.
void weighInputs(const LayerShape& shape, Pairing pairing, Eigen::MatrixXf& weight) {
  constexpr float kOffsetScale = 10.0F;  // offsets are about a tenth as long as points
  constexpr int kFeatures = 2 * kFeatureSize;
  if (shape.name == "flow.source_encoder.0" || shape.name == "flow.decoder.0") {
    weight.middleCols(kFlowFirstVector, 4 * kFlowVectors) *= kOffsetScale;
  } else if (shape.name == "flow.target_encoder.0") {
    weight.rightCols(3) *= kOffsetScale;
  } else if (shape.name == "nonrigid.decoder.0") {
    const float inputs = static_cast<float>(shape.inputs);
    const float alone = std::sqrt(inputs / (inputs - kFeatures));  // as a layer without features
    weight.leftCols(3) *= alone;
    weight.rightCols(shape.inputs - kFeatures - 3) *=
        pairing == Pairing::kNearest ? alone * kOffsetScale : alone;
  }
}

}  // namespace

void validate(const Weights& weights) {
  const auto shapes = layerShapes(weights.pairing);
  for (const LayerShape& shape : shapes) {
    const auto found = weights.layers.find(shape.name);
    if (found == weights.layers.end()) {
      throw std::invalid_argument("weights: layer \"" + shape.name + "\" is missing");
    }
    const Layer& layer = found->second;
    if (layer.weight.rows() != shape.outputs || layer.weight.cols() != shape.inputs ||
        layer.bias.size() != shape.outputs) {
      throw std::invalid_argument("weights: layer \"" + shape.name + "\" is not " +
                                  std::to_string(shape.outputs) + " x " +
                                  std::to_string(shape.inputs));
    }
    if (!layer.weight.allFinite() || !layer.bias.allFinite()) {
      throw std::invalid_argument("weights: layer \"" + shape.name +
                                  "\" holds a value that is not finite");
    }
  }
  if (weights.layers.size() != shapes.size()) {
    throw std::invalid_argument("weights: there are layers the network does not know");
  }
}

Weights readWeights(const std::string& path) {
  try {
    return parseWeights(readBytes(path));
  } catch (const std::runtime_error& fault) {
    throw std::runtime_error("weights file " + path + " " + fault.what());
  }
}

void writeWeights(const Weights& weights, const std::string& path) {
  validate(weights);
  std::map<std::string, std::string> bytes;
  TensorFile file;
  file.metadata = weights.metadata;
  file.metadata["architecture"] = kArchitecture;
  file.metadata["pairing"] = toString(weights.pairing);
  for (const LayerShape& shape : layerShapes(weights.pairing)) {
    const Layer& layer = weights.layers.at(shape.name);
    const auto outputs = static_cast<std::uint64_t>(shape.outputs);
    const auto add = [&](const std::string& name, std::vector<std::uint64_t> size,
                         const auto& values) {
      const auto& stored = bytes[name] = toHalfBytes(values, name);
      file.tensors[name] = {"F16", std::move(size), stored};
    };
    add(shape.name + ".weight", {outputs, static_cast<std::uint64_t>(shape.inputs)}, layer.weight);
    add(shape.name + ".bias", {outputs}, layer.bias);
  }
  writeAtomically(path, "weights file",
                  [&](std::ostream& stream) { stream << formatSafetensors(file); });
}

Weights randomWeights(Pairing pairing, unsigned seed) {
  constexpr double kLastLayerScale = 0.05, kLastFlowScale = 0.005;
  Random random(seed);
  Weights weights;
  weights.pairing = pairing;
  for (const LayerShape& shape : layerShapes(pairing)) {
    double scale = 1.0;
    if (shape.outputs == kFlowDecoderWidths.back()) scale = kLastFlowScale;
    if (shape.outputs == kRigidDecoderWidths.back() ||
        shape.outputs == kNonRigidDecoderWidths.back()) {
      scale = kLastLayerScale;
    }
    const double deviation = scale * std::sqrt(2.0 / shape.inputs);
    Layer& layer = weights.layers[shape.name];
    layer.weight = Eigen::MatrixXf::NullaryExpr(shape.outputs, shape.inputs, [&] {
      return static_cast<float>(deviation * random.normal());
    });
    weighInputs(shape, pairing, layer.weight);
    layer.bias = Eigen::VectorXf::Zero(shape.outputs);
  }
  for (auto& [name, layer] : weights.layers) {
    if (layer.bias.size() == kRigidDecoderWidths.back()) layer.bias[0] = 1.0F;
  }
  return weights;
}

}  // namespace unirit
