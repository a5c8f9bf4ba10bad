// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/pair_set.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <ostream>
#include <stdexcept>

#include "../atomic_file.hpp"
#include "../network/safetensors.hpp"
#include "pair_set_format.hpp"

namespace unirit {
namespace {

using Json = nlohmann::json;
/// A tensor of the file: what each case contributes to it, one after the other.
struct Tensor {
  std::string type;
  std::vector<std::uint64_t> case_shape;
  std::function<void(const PairSetCase&, std::ostream&)> write;

  std::uint64_t caseSize() const {
    std::uint64_t size = type == "F64" ? sizeof(double) : sizeof(float);
    for (const std::uint64_t dimension : case_shape) size *= dimension;
    return size;
  }
};

template <class Matrix>
void writeValues(const Matrix& values, std::ostream& stream) {
  stream.write(reinterpret_cast<const char*>(values.data()),
               static_cast<std::streamsize>(sizeof(values.data()[0]) * values.size()));
}

Tensor pointsTensor(Eigen::Index count, const std::function<Points(const PairSetCase&)>& points) {
  return {
      "F32",
      {static_cast<std::uint64_t>(count), 3},
      [points](const PairSetCase& one, std::ostream& stream) { writeValues(points(one), stream); }};
}

Eigen::Vector3f viewpointOrNan(const Sight& sight) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  return sight.viewpoint.value_or(Eigen::Vector3f::Constant(kNan));
}

void requireEqualShapes(const PairSet& set) {
  if (set.cases.empty()) throw std::invalid_argument("set: has no case");
  const DeformedPoints& first = set.cases.front().seen.points;
  for (const PairSetCase& one : set.cases) {
    const DeformedPoints& points = one.seen.points;
    bool equal = one.seen.sights.size() == set.protocols.size() &&
                 points.source.cols() == first.source.cols() &&
                 points.source_normals.cols() == first.source.cols() &&
                 points.truth.cols() == first.source.cols() &&
                 points.surface.cols() == first.surface.cols() &&
                 points.interior.cols() == points.interior_truth.cols();
    for (const Sight& sight : one.seen.sights) {
      equal = equal && sight.target.cols() == first.source.cols();
    }
    if (!equal) throw std::invalid_argument("set: its cases differ in their numbers of points");
  }
}

std::map<std::string, Tensor> tensorsOf(const PairSet& set) {
  std::map<std::string, Tensor> tensors;
  for (const SharedTensor& shared : kSharedTensors) {
    Eigen::Index count = std::numeric_limits<Eigen::Index>::max();
    for (const PairSetCase& one : set.cases) {
      count = std::min(count, (one.seen.points.*shared.points).cols());
    }
    tensors[shared.name] =
        pointsTensor(count, [points = shared.points, count](const PairSetCase& one) -> Points {
          return (one.seen.points.*points).leftCols(count);
        });
  }
  for (std::size_t k = 0; k < set.protocols.size(); ++k) {
    const std::string protocol = toString(set.protocols[k]);
    const auto sight = [k](const PairSetCase& one) -> const Sight& { return one.seen.sights[k]; };
    tensors[protocol + "/target"] =
        pointsTensor(set.cases.front().seen.points.source.cols(),
                     [sight](const PairSetCase& one) { return sight(one).target; });
    tensors[protocol + "/pose"] = {
        "F64", {4, 4}, [sight](const PairSetCase& one, std::ostream& stream) {
          writeValues(StoredPose(sight(one).pose.matrix()), stream);
        }};
    tensors[protocol + "/viewpoint"] = {
        "F32", {3}, [sight](const PairSetCase& one, std::ostream& stream) {
          writeValues(viewpointOrNan(sight(one)), stream);
        }};
  }
  return tensors;
}

std::map<std::string, std::string> metadataOf(const PairSet& set) {
  Json cases = Json::array();
  for (const PairSetCase& one : set.cases) {
    cases.push_back({{"organ", one.organ},
                     {"subject", one.subject},
                     {"variation", one.variation},
                     {"deformation", one.deformation},
                     {"seed", one.seed}});
  }
  Json protocols = Json::array();
  for (const Protocol protocol : set.protocols) protocols.push_back(toString(protocol));
  return {{"format", kPairSetFormat},
          {"version", kPairSetVersion},
          {"unit", "m"},
          {"protocols", protocols.dump()},
          {"cases", cases.dump(-1, ' ', false, Json::error_handler_t::replace)}};
}

}  // namespace

RegistrationPair PairSet::pair(const PairSetCase& one, Protocol protocol) const {
  const auto found = std::find(protocols.begin(), protocols.end(), protocol);
  if (found == protocols.end()) {
    throw std::invalid_argument(std::string("protocol: the set lacks '") + toString(protocol) +
                                "'");
  }
  const auto index = static_cast<std::size_t>(found - protocols.begin());
  return joinPair(one.seen.points, one.seen.sights.at(index));
}

void writePairSet(const PairSet& set, const std::string& path) {
  requireEqualShapes(set);
  const std::map<std::string, Tensor> tensors = tensorsOf(set);
  std::map<std::string, TensorLayout> layouts;
  for (const auto& [name, tensor] : tensors) {
    TensorLayout layout{tensor.type, {set.cases.size()}, tensor.caseSize() * set.cases.size()};
    layout.shape.insert(layout.shape.end(), tensor.case_shape.begin(), tensor.case_shape.end());
    layouts[name] = layout;
  }
  writeAtomically(path, "pair set", [&](std::ostream& stream) {
    stream << formatSafetensorsHeader(metadataOf(set), layouts);
    for (const auto& [name, tensor] : tensors) {
      for (const PairSetCase& one : set.cases) tensor.write(one, stream);
    }
  });
}

}  // namespace unirit
