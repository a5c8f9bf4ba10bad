// SPDX-License-Identifier: BSD-3-Clause
// Command line that makes pair sets: organ surfaces in, pairs with known truth out.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "../atomic_file.hpp"
#include "pairs_manifest.hpp"
#include "pairs_options.hpp"
#include "unirit/hash.hpp"
#include "unirit/io/organ_folder.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

std::string contents(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

OrganSource fileSource(const OrganFile& file, double unit) {
  return {file.organ, file.subject, file.name, [file, unit] {
            return LoadedOrgan{readOrganSurface(file, unit), sha256Hex(contents(file.path))};
          }};
}

OrganSource phantomSource(const std::string& organ, int patient) {
  const std::string number = std::to_string(patient);
  return {organ, "phantom_" + number, "phantom/" + organ + "/" + number, [organ, patient] {
            Surface surface = makePhantom(organ, static_cast<std::uint64_t>(patient));
            const Points& points = surface.vertices.points;
            const std::string_view bytes(reinterpret_cast<const char*>(points.data()),
                                         sizeof(float) * static_cast<std::size_t>(points.size()));
            std::string hash = sha256Hex(bytes);
            return LoadedOrgan{std::move(surface), std::move(hash)};
          }};
}

std::vector<OrganSource> sourcesOf(const PairsOptions& options,
                                   std::vector<std::string>& left_out) {
  std::vector<OrganSource> sources;
  for (const std::string& folder : options.data) {
    for (const OrganFile& file : listOrganFiles(
             folder, [&](const std::string& sentence) { left_out.push_back(sentence); })) {
      sources.push_back(fileSource(file, options.unit));
    }
  }
  for (const std::string& organ : phantomOrgans()) {
    for (int patient = 0; patient < options.phantoms; ++patient) {
      sources.push_back(phantomSource(organ, patient));
    }
  }
  const auto excluded = [&](const OrganSource& source) {
    return std::count(options.exclude.begin(), options.exclude.end(), source.organ) > 0;
  };
  sources.erase(std::remove_if(sources.begin(), sources.end(), excluded), sources.end());
  return sources;
}

/// Seeds, and the rows of a benchmark, tell surfaces apart by these names.
void requireDistinctNames(const std::vector<OrganSource>& sources) {
  std::set<std::string> names;
  for (const OrganSource& source : sources) {
    if (!names.insert(source.name).second) {
      throw std::runtime_error(source.name +
                               " lies in two of the folders: give one folder that holds both");
    }
  }
}

/// A line that is written over on a terminal, and every ten seconds elsewhere.
class ProgressLine {
 public:
  void operator()(std::size_t done, std::size_t total) {
    const double seconds = secondsSince(start_);
    const bool last = done == total;
    if (!last && secondsSince(shown_) < (terminal_ ? 0.2 : 10.0)) return;
    shown_ = Clock::now();
    const double left = seconds / static_cast<double>(done) * static_cast<double>(total - done);
    std::fprintf(stderr, "%s%zu of %zu organs, %.0f s, %.0f s left%s", terminal_ ? "\r\033[K" : "",
                 done, total, seconds, left, terminal_ && !last ? "" : "\n");
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double secondsSince(Clock::time_point time) {
    return std::chrono::duration<double>(Clock::now() - time).count();
  }

  bool terminal_ = ::isatty(STDERR_FILENO) == 1;
  Clock::time_point start_ = Clock::now(), shown_ = start_;
};

void printSummary(const BuiltPairs& pairs, const PairsOptions& options) {
  std::map<std::string, int> cases;
  for (const PairSetCase& one : pairs.set.cases) ++cases[one.organ];
  std::printf("%s: %zu cases under %zu protocols\n", options.output.c_str(), pairs.set.cases.size(),
              pairs.set.protocols.size());
  for (const auto& [organ, count] : cases) std::printf("  %s %d\n", organ.c_str(), count);
}

/// Of the organs as they were read, each once.
std::string divergencesOf(const PairSet& set, const DivergenceSettings& settings) {
  std::vector<LabelledCloud> clouds;
  for (const PairSetCase& one : set.cases) {
    if (one.variation == 0 && one.deformation == 0) {
      clouds.push_back({one.organ, one.seen.points.source});
    }
  }
  return toMarkdown(divergenceTable(clouds, settings));
}

void makeFolderOf(const std::string& path) {
  fs::create_directories(fs::absolute(path).parent_path());
}

void writeText(const std::string& text, const std::string& path) {
  makeFolderOf(path);
  writeAtomically(path, "file", [&](std::ostream& stream) { stream << text; });
}

void run(const PairsOptions& options) {
  const std::string manifest = fs::path(options.output).replace_extension(".json").string();
  for (const std::string& path : {options.output, manifest, options.divergences}) {
    if (!path.empty()) requirePlaceFor(path);
  }
  std::vector<std::string> left_out;
  const std::vector<OrganSource> sources = sourcesOf(options, left_out);
  requireDistinctNames(sources);
  for (const std::string& sentence : left_out) std::cerr << "left out: " << sentence << '\n';
  if (sources.empty()) throw std::runtime_error("no organ surface was found");
  const BuiltPairs pairs = buildPairs(sources, options.settings, ProgressLine());
  for (const SourceRecord& source : pairs.sources) {
    for (const std::string& sentence : source.rejected) {
      std::cerr << "left out: " << sentence << '\n';
    }
  }
  if (pairs.set.cases.empty()) throw std::runtime_error("no pair could be made of these organs");
  makeFolderOf(options.output);
  writePairSet(pairs.set, options.output);
  writeText(pairsManifest(options, pairs, left_out, sha256Hex(contents(options.output))), manifest);
  if (!options.divergences.empty()) {
    writeText(divergencesOf(pairs.set, options.divergence), options.divergences);
  }
  printSummary(pairs, options);
}

}  // namespace
}  // namespace unirit

int main(int argc, char** argv) {
  const auto [options, exit_status] = unirit::parsePairsOptions(argc, argv);
  if (exit_status >= 0) return exit_status;
  try {
    unirit::run(options);
  } catch (const std::exception& error) {
    std::cerr << "unirit_pairs: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
