// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace unirit {

/// The command line of unirit_benchmark.
struct BenchmarkOptions {
  std::string data;   // folder of organs
  int phantoms = 0;   // of each organ, in place of `data`
  std::string cases;  // pair set or folder of stored cases, in place of both
  std::string label;  // what tables call the data; empty: the folder's name
  std::vector<std::string> exclude{"small_bowel"};
  std::vector<std::string> protocols{"permuted", "resampled", "caseb", "partial", "intraop"};
  int pairs = 1;
  int points = 1024;
  double common_rotation = 0.0;  // [degree]
  std::uint64_t seed = 1;

  std::vector<std::string> methods{"identity", "best-rigid", "unirit:stages=rigid", "unirit"};
  std::string weights;

  std::string output = "benchmark";  // folder
  int threads = 2;
  int shard = 1;  // of `shards`
  int shards = 1;
  bool merge = false;
  bool clouds = false;

  /// Of the rows of this run, in `output`.
  std::string recordsPath() const;
};

/// Reads the command line. Nothing where the program is to end at once with `exit_status`: 0 after
/// --help, 2 after a sentence on stderr.
std::optional<BenchmarkOptions> parseBenchmarkOptions(int argc, char** argv, int& exit_status);

}  // namespace unirit
