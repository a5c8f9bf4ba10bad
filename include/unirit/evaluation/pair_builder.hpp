// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "unirit/evaluation/pair_set.hpp"
#include "unirit/evaluation/screening.hpp"

namespace unirit {

struct LoadedOrgan {
  Surface surface;
  std::string sha256;  ///< of the file's bytes, or of the vertices where there is no file
};

/// An organ's surface that is made or read when its turn comes.
struct OrganSource {
  std::string organ;                  ///< class, "liver"
  std::string subject;                ///< "ircad_01"
  std::string name;                   ///< tells it from every other source; seeds depend on it
  std::function<LoadedOrgan()> load;  ///< throws std::runtime_error with a sentence
};

struct PairSettings {
  std::vector<Protocol> protocols;
  Eigen::Index points = 1024;            ///< of each cloud
  Eigen::Index surface_samples = 20000;  ///< of the true surface, kept for the metrics
  int deformations = 1;                  ///< of each surface
  int variations = 0;                    ///< further anatomies made from each surface
  int subjects = 0;                      ///< of each class, at least, varied anatomies counted
  std::uint64_t seed = 1;
  int threads = 1;
  ScreeningLimits limits;
};

/// What became of a source.
struct SourceRecord {
  std::string organ, subject, name, sha256;
  std::vector<std::string> rejected;  ///< clauses that say what was left out and why
  std::size_t cases = 0;
};

struct BuiltPairs {
  PairSet set;
  std::vector<SourceRecord> sources;  ///< in the sequence given
};

/// Screens each source, varies and deforms it, and sees it under every protocol. A case's seed
/// comes from the settings' seed, the source's name, variation and deformation alone: the set has
/// the same bits for any number of threads, and other sources do not change a case; they may change
/// how many variations it takes to give a class its subjects. `progress` is told how many sources
/// of how many are done, by one thread at a time.
BuiltPairs buildPairs(const std::vector<OrganSource>& sources, const PairSettings& settings,
                      const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace unirit
