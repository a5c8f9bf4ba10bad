// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark_cases.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>

#include "chosen_organs.hpp"
#include "unirit/evaluation/case_folder.hpp"
#include "unirit/evaluation/pair_set.hpp"
#include "unirit/random.hpp"

namespace unirit {
namespace {

/// Turns both clouds together: the problem stays the same, but the network was made for organs as
/// scanners lay them.
void turn(RegistrationPair& pair, double degrees, std::uint64_t seed) {
  const Eigen::Isometry3d rotation(
      Eigen::AngleAxisd(degrees * M_PI / 180.0, Random(seed).direction()));
  const Eigen::Matrix3f turned = rotation.linear().cast<float>();
  for (Points* points : {&pair.source, &pair.source_normals, &pair.target, &pair.truth,
                         &pair.interior, &pair.interior_truth, &pair.surface}) {
    *points = turned * *points;
  }
  pair.best_rigid = rotation * pair.best_rigid * rotation.inverse();
  if (pair.viewpoint) pair.viewpoint = turned * *pair.viewpoint;
}

/// Of "partial:30": the protocol, and its view with 30 % of the surface seen.
std::pair<Protocol, View> parseProtocol(const std::string& text) {
  const std::size_t colon = text.find(':');
  const Protocol protocol = protocolFromString(text.substr(0, colon));
  View view = viewOf(protocol);
  if (colon == std::string::npos) return {protocol, view};
  double percent = 0.0;
  char end = '\0';
  if (view.visible_share == 1.0 ||
      std::sscanf(text.c_str() + colon, ":%lf%c", &percent, &end) != 1 ||
      !(percent > 0.0 && percent < 100.0)) {
    throw std::invalid_argument("protocol '" + text +
                                "': only partial and intraop take a share in view, in percent");
  }
  view.visible_share = percent / 100.0;
  return {protocol, view};
}

std::string labelOf(const BenchmarkOptions& options) {
  if (!options.label.empty()) return options.label;
  if (options.phantoms > 0) return "phantoms";
  const std::string& folder = options.cases.empty() ? options.data : options.cases;
  return std::filesystem::weakly_canonical(folder).filename().string();
}

bool wanted(const BenchmarkOptions& options, const std::string& protocol) {
  const auto& all = options.protocols;
  return std::find(all.begin(), all.end(), protocol) != all.end();
}

std::vector<BenchmarkCase> storedCases(const BenchmarkOptions& options) {
  std::vector<BenchmarkCase> cases;
  for (const CaseFolder& folder : listCaseFolders(options.cases)) {
    if (!wanted(options, folder.protocol)) continue;
    cases.push_back({labelOf(options), folder.protocol, protocolFromString(folder.protocol),
                     folder.organ, folder.subject, "stored",
                     [path = folder.path] { return readCaseFolder(path); }});
  }
  return cases;
}

std::vector<BenchmarkCase> pairSetCases(const BenchmarkOptions& options) {
  const auto set = std::make_shared<const PairSet>(readPairSet(options.cases));
  std::vector<BenchmarkCase> cases;
  for (const Protocol protocol : set->protocols) {
    if (!wanted(options, toString(protocol))) continue;
    for (const PairSetCase& one : set->cases) {
      std::string subject = one.subject;
      if (one.variation > 0) subject += " variation " + std::to_string(one.variation);
      if (one.deformation > 0) subject += " deformation " + std::to_string(one.deformation);
      cases.push_back({labelOf(options), toString(protocol), protocol, one.organ, subject,
                       std::to_string(one.seed),
                       [set, &one, protocol] { return set->pair(one, protocol); }});
    }
  }
  return cases;
}

std::vector<BenchmarkCase> madeCases(const BenchmarkOptions& options) {
  const auto organs = std::make_shared<const std::vector<Organ>>(
      chosenOrgans(options.data, options.exclude, options.phantoms));
  const std::string label = labelOf(options);
  std::vector<BenchmarkCase> cases;
  for (const std::string& name : options.protocols) {
    const auto [protocol, view] = parseProtocol(name);
    std::uint64_t number = 0;
    for (const Organ& organ : *organs) {
      for (int i = 0; i < options.pairs; ++i) {
        const std::uint64_t seed = options.seed * 1000003ULL + number++;
        const auto load = [organs, &organ, view = view, seed, points = options.points,
                           angle = options.common_rotation] {
          RegistrationPair pair = makePair(organ.surface, view, points, seed);
          if (angle > 0.0) turn(pair, angle, seed);
          return pair;
        };
        cases.push_back(
            {label, name, protocol, organ.name, organ.subject, std::to_string(seed), load});
      }
    }
  }
  return cases;
}

}  // namespace

std::vector<BenchmarkCase> benchmarkCases(const BenchmarkOptions& options) {
  const std::vector<BenchmarkCase> cases = options.cases.empty() ? madeCases(options)
                                           : std::filesystem::is_regular_file(options.cases)
                                               ? pairSetCases(options)
                                               : storedCases(options);
  if (cases.empty()) throw std::runtime_error("no cases: the data hold none of the protocols");
  return cases;
}

}  // namespace unirit
