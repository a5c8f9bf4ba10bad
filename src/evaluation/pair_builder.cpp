// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/pair_builder.hpp"

#include <algorithm>
#include <atomic>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "unirit/hash.hpp"
#include "unirit/simulation/anatomical_variation.hpp"

namespace unirit {
namespace {

constexpr int kMostVariationDraws = 20;

struct Built {
  SourceRecord record;
  std::vector<PairSetCase> cases;
};

/// The first 64 bits of a hash over everything that tells one draw from another.
std::uint64_t seedOf(const PairSettings& settings, const std::string& name,
                     const std::string& draw) {
  const std::string text = std::to_string(settings.seed) + "/" + name + "/" + draw;
  return std::stoull(sha256Hex(text).substr(0, 16), nullptr, 16);
}

/// A varied anatomy that passes the screening as its original did.
Surface drawVariation(const Surface& original, const OrganSource& source, int variation,
                      const PairSettings& settings) {
  std::string reason;
  for (int draw = 0; draw < kMostVariationDraws; ++draw) {
    const std::string name =
        "variation " + std::to_string(variation) + " draw " + std::to_string(draw);
    Surface varied = varyAnatomy(original, seedOf(settings, source.name, name));
    reason = rejectionReason(varied, source.organ, settings.limits);
    if (reason.empty()) return varied;
  }
  throw std::runtime_error("every varied anatomy drawn " + reason);
}

void addCases(const Surface& surface, const OrganSource& source, int variation,
              const PairSettings& settings, Built& built) {
  for (int deformation = 0; deformation < settings.deformations; ++deformation) {
    const std::uint64_t seed =
        seedOf(settings, source.name,
               std::to_string(variation) + " deformation " + std::to_string(deformation));
    built.cases.push_back({source.organ, source.subject, variation, deformation, seed,
                           makeSeenOrgan(surface, settings.protocols, settings.points,
                                         settings.surface_samples, seed)});
  }
}

bool passesScreening(const OrganSource& source, const ScreeningLimits& limits) {
  try {
    return rejectionReason(source.load().surface, source.organ, limits).empty();
  } catch (const std::exception&) {
    return false;  // told when the source is built
  }
}

/// Variations to make of each source: those asked for, and as many more as its class is short of
/// subjects, shared out evenly among the surfaces that pass the screening.
std::vector<int> variationsOf(const std::vector<OrganSource>& sources,
                              const PairSettings& settings) {
  std::vector<int> variations(sources.size(), settings.variations);
  std::map<std::string, std::vector<std::size_t>> classes;  // of usable sources
  for (std::size_t i = 0; i < sources.size(); ++i) {
    auto& members = classes[sources[i].organ];
    const bool full = static_cast<int>(members.size()) >= settings.subjects;
    if (!full && passesScreening(sources[i], settings.limits)) members.push_back(i);
  }
  for (const auto& [organ, members] : classes) {
    const int count = static_cast<int>(members.size()), missing = settings.subjects - count;
    for (int k = 0; k < count; ++k) {
      int& number = variations[members[static_cast<std::size_t>(k)]];
      number = std::max(number, missing / count + (k < missing % count ? 1 : 0));
    }
  }
  return variations;
}

Built buildSource(const OrganSource& source, int variations, const PairSettings& settings) {
  Built built{{source.organ, source.subject, source.name, {}, {}, 0}, {}};
  std::string which;  // what an error is about; where the file cannot be read it says so itself
  try {
    const auto [original, sha256] = source.load();
    which = source.name + ": ";
    built.record.sha256 = sha256;
    const std::string reason = rejectionReason(original, source.organ, settings.limits);
    if (!reason.empty()) throw std::runtime_error(reason);
    addCases(original, source, 0, settings, built);
    for (int variation = 1; variation <= variations; ++variation) {
      which = source.name + ", variation " + std::to_string(variation) + ": ";
      addCases(drawVariation(original, source, variation, settings), source, variation, settings,
               built);
    }
  } catch (const std::exception& error) {
    built.record.rejected.push_back(which + error.what());
  }
  built.record.cases = built.cases.size();
  return built;
}

void validate(const PairSettings& settings) {
  const auto require = [](bool valid, const char* sentence) {
    if (!valid) throw std::invalid_argument(sentence);
  };
  require(!settings.protocols.empty(), "settings.protocols: at least one must be named");
  require(settings.points >= 1, "settings.points: must be positive");
  require(settings.surface_samples >= 0, "settings.surface_samples: must not be negative");
  require(settings.deformations >= 1, "settings.deformations: must be positive");
  require(settings.variations >= 0, "settings.variations: must not be negative");
  require(settings.subjects >= 0, "settings.subjects: must not be negative");
  require(settings.threads >= 1, "settings.threads: must be positive");
}

}  // namespace

BuiltPairs buildPairs(const std::vector<OrganSource>& sources, const PairSettings& settings,
                      const std::function<void(std::size_t, std::size_t)>& progress) {
  validate(settings);
  const std::vector<int> variations = variationsOf(sources, settings);
  std::vector<Built> built(sources.size());
  std::atomic<std::size_t> next{0};
  std::size_t done = 0;
  std::mutex mutex;
  const auto work = [&] {
    for (std::size_t i = next++; i < sources.size(); i = next++) {
      built[i] = buildSource(sources[i], variations[i], settings);
      const std::lock_guard lock(mutex);
      progress(++done, sources.size());
    }
  };
  std::vector<std::thread> threads;
  for (int t = 1; t < settings.threads; ++t) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();

  BuiltPairs pairs{{settings.protocols, {}}, {}};
  for (Built& one : built) {
    pairs.sources.push_back(std::move(one.record));
    std::move(one.cases.begin(), one.cases.end(), std::back_inserter(pairs.set.cases));
  }
  return pairs;
}

}  // namespace unirit
