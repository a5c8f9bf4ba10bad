// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "../network/safetensors.hpp"
#include "pair_set_format.hpp"

namespace unirit {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t kMostRows = 1U << 30U;  // keeps products far from an overflow

/// A pair set's bytes, taken apart; its errors are clauses that continue "the file ...".
class Reader {
 public:
  explicit Reader(std::string bytes) : bytes_(std::move(bytes)), file_(parseSafetensors(bytes_)) {
    if (text("format") != kPairSetFormat) throw std::runtime_error("is no pair set");
    if (text("version") != kPairSetVersion) {
      throw std::runtime_error("is of version " + text("version") + ", not " + kPairSetVersion);
    }
  }

  PairSet read() const {
    PairSet set;
    try {
      for (const Json& name : Json::parse(text("protocols"))) {
        set.protocols.push_back(protocolFromString(name.get<std::string>()));
      }
      for (const Json& entry : Json::parse(text("cases"))) set.cases.push_back(caseFrom(entry));
    } catch (const Json::exception&) {
      throw std::runtime_error("has metadata that is damaged");
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(std::string("has another ") + error.what());
    }
    for (const SharedTensor& shared : kSharedTensors) {
      const Slices slices = tensor(shared.name, "F32", set.cases.size(), 2);
      for (std::size_t c = 0; c < set.cases.size(); ++c) {
        set.cases[c].seen.points.*shared.points = slices.points(c);
      }
    }
    for (const Protocol protocol : set.protocols) readSights(toString(protocol), set);
    return set;
  }

 private:
  /// A tensor, cut along its first dimension.
  struct Slices {
    std::string_view bytes;
    std::size_t size = 0;  // of one case [byte]

    template <class Matrix>
    void copyTo(std::size_t index, Matrix& values) const {
      bytes.copy(reinterpret_cast<char*>(values.data()), size, index * size);
    }
    Points points(std::size_t index) const {
      Points values(3, static_cast<Eigen::Index>(size / (3 * sizeof(float))));
      copyTo(index, values);
      return values;
    }
  };

  std::string text(const std::string& key) const {
    const auto found = file_.metadata.find(key);
    return found == file_.metadata.end() ? std::string() : found->second;
  }

  static PairSetCase caseFrom(const Json& entry) {
    PairSetCase one;
    entry.at("organ").get_to(one.organ);
    entry.at("subject").get_to(one.subject);
    entry.at("variation").get_to(one.variation);
    entry.at("deformation").get_to(one.deformation);
    entry.at("seed").get_to(one.seed);
    return one;
  }

  Slices tensor(const std::string& name, const std::string& type, std::size_t cases,
                std::size_t case_dimensions) const {
    const auto found = file_.tensors.find(name);
    if (found == file_.tensors.end()) throw std::runtime_error("lacks the tensor " + name);
    const TensorView& view = found->second;
    const std::uint64_t last = type == "F64" ? 4 : 3;
    std::uint64_t size = type == "F64" ? sizeof(double) : sizeof(float);
    bool valid = view.type == type && view.shape.size() == case_dimensions + 1 &&
                 view.shape.front() == cases && view.shape.back() == last;
    for (std::size_t i = 1; valid && i < view.shape.size(); ++i) {
      valid = view.shape[i] <= kMostRows;
      size *= view.shape[i];
    }
    if (!valid || size * cases != view.bytes.size() || (type == "F64" && view.shape[1] != 4)) {
      throw std::runtime_error("has a misshapen tensor " + name);
    }
    return {view.bytes, size};
  }

  void readSights(const std::string& protocol, PairSet& set) const {
    const std::size_t count = set.cases.size();
    const Slices targets = tensor(protocol + "/target", "F32", count, 2);
    const Slices poses = tensor(protocol + "/pose", "F64", count, 2);
    const Slices viewpoints = tensor(protocol + "/viewpoint", "F32", count, 1);
    for (std::size_t c = 0; c < count; ++c) {
      StoredPose pose;
      Eigen::Vector3f viewpoint;
      poses.copyTo(c, pose);
      viewpoints.copyTo(c, viewpoint);
      Sight sight{targets.points(c), Eigen::Isometry3d(Eigen::Matrix4d(pose)), std::nullopt};
      if (viewpoint.allFinite()) sight.viewpoint = viewpoint;
      set.cases[c].seen.sights.push_back(std::move(sight));
    }
  }

  std::string bytes_;
  TensorFile file_;  // points into them
};

}  // namespace

PairSet readPairSet(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error("The pair set \"" + path + "\" cannot be opened.");
  std::ostringstream content;
  content << stream.rdbuf();
  try {
    return Reader(content.str()).read();
  } catch (const std::runtime_error& error) {
    throw std::runtime_error("The pair set \"" + path + "\" " + error.what() + ".");
  }
}

}  // namespace unirit
