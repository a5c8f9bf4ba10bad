// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/method_factory.hpp"

#include <algorithm>
#include <stdexcept>

#include "unirit/evaluation/baselines.hpp"
#include "unirit/evaluation/settings_text.hpp"

namespace unirit {
namespace {

using Values = std::map<std::string, std::string>;

/// Splits "NAME:KEY=VALUE:..." into the name, returned, and the values.
std::string parse(const std::string& description, Values& values) {
  std::istringstream parts(description);
  std::string name;
  std::getline(parts, name, ':');
  for (std::string part; std::getline(parts, part, ':');) {
    const std::size_t equals = part.find('=');
    if (equals == std::string::npos) {
      throw std::invalid_argument("method '" + description + "': '" + part + "' is no KEY=VALUE");
    }
    values[part.substr(0, equals)] = part.substr(equals + 1);
  }
  return name;
}

std::string takeText(Values& values, const std::string& key, const std::string& otherwise) {
  const auto found = values.find(key);
  if (found == values.end()) return otherwise;
  const std::string value = found->second;
  values.erase(found);
  return value;
}

template <class Settings>
Settings changed(Settings settings, Values& values) {
  take(values, settings);
  return settings;
}

bool takeStart(Values& values) {
  const std::string start = takeText(values, "start", "identity");
  if (start == "identity" || start == "centroids") return start == "centroids";
  throw std::invalid_argument("start: '" + start + "' is neither identity nor centroids");
}

/// Every setting can be given by its name; the stages are joined by "+".
std::unique_ptr<RegistrationMethod> makeUnirit(std::shared_ptr<const Weights> weights,
                                               Values& values, Protocol protocol) {
  RegistrationSettings settings;
  if (protocol == Protocol::kPaired || protocol == Protocol::kPermuted) {
    settings.refinement.correspondence = Correspondence::kPoints;
  }
  for (const WordSetting& word : wordSettings()) {
    std::string value = takeText(values, word.name, word.get(settings));
    std::replace(value.begin(), value.end(), '+', ',');
    word.set(settings, value);
  }
  visitSettings(settings, [&](const char* name, auto& value, auto, auto, const char*) {
    std::istringstream text(takeText(values, name, ""));
    if (text.str().empty()) return;
    if (!(text >> value) || text.peek() != std::istringstream::traits_type::eof()) {
      throw std::invalid_argument(std::string(name) + ": '" + text.str() + "' is no value for it");
    }
  });
  return std::make_unique<Unirit>(std::move(weights), settings, takeStart(values));
}

/// Null where the name is unknown; a method without settings or weights needs neither.
std::unique_ptr<RegistrationMethod> makeRival(const std::string& name, Values& values,
                                              Protocol protocol) {
  using Variant = Icp::Variant;
  if (name == "identity") return std::make_unique<Identity>();
  if (name == "best-rigid") return std::make_unique<BestRigidOracle>();
  if (name == "icp") {
    return std::make_unique<Icp>(Variant::kPointToPoint, changed(tunedIcp(protocol), values));
  }
  if (name == "gicp") {
    return std::make_unique<Icp>(Variant::kGeneralized,
                                 changed(tunedGeneralizedIcp(protocol), values));
  }
  if (name == "cpd-rigid") {
    return std::make_unique<CoherentPointDrift>(true, changed(tunedRigidCpd(protocol), values));
  }
  if (name == "cpd") {
    return std::make_unique<CoherentPointDrift>(false, changed(tunedCpd(protocol), values));
  }
  if (name == "bcpd") {
    return std::make_unique<BayesianPointDrift>(changed(tunedBcpd(protocol), values));
  }
  return nullptr;
}

}  // namespace

std::unique_ptr<RegistrationMethod> MethodFactory::make(const std::string& description,
                                                        Protocol protocol) {
  Values values;
  const std::string name = parse(description, values);
  std::unique_ptr<RegistrationMethod> method = makeRival(name, values, protocol);
  if (name == "unirit" || name == "unirit-rows") {
    auto chosen = weights(takeText(values, "weights", default_weights_));
    method = name == "unirit" ? makeUnirit(std::move(chosen), values, protocol)
                              : std::make_unique<UniritByRows>(std::move(chosen));
  }
  if (!method) {
    throw std::invalid_argument("method '" + description +
                                "': unknown, known are identity, best-rigid, icp, gicp, "
                                "cpd-rigid, cpd, bcpd, unirit, unirit-rows");
  }
  if (!values.empty()) {
    throw std::invalid_argument("method '" + description + "': unknown key '" +
                                values.begin()->first + "'");
  }
  return method;
}

std::shared_ptr<const Weights> MethodFactory::weights(const std::string& path) {
  if (path.empty()) throw std::invalid_argument("method 'unirit': needs weights");
  std::shared_ptr<const Weights>& known = weights_[path];
  if (!known) known = std::make_shared<const Weights>(readWeights(path));
  return known;
}

}  // namespace unirit
