// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace unirit {

/// The command line of unirit_refusals.
struct RefusalsOptions {
  std::string data;  // folder of organs
  int phantoms = 0;  // of each organ, in place of `data`
  std::vector<std::string> exclude{"small_bowel"};
  int subjects = 1000;  // of each organ class, at most
  int rounds = 1;       // of all kinds of trials for each organ
  int points = 1024;
  std::uint64_t seed = 1;
  std::string weights;
  std::string settings;  // file; empty: defaults
  std::string output = "refusals";
  int threads = 2;
};

/// Reads the command line. Nothing where the program is to end at once with `exit_status`: 0 after
/// --help, 2 after a sentence on stderr.
std::optional<RefusalsOptions> parseRefusalsOptions(int argc, char** argv, int& exit_status);

}  // namespace unirit
