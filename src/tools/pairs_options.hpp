// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "unirit/evaluation/divergence_table.hpp"
#include "unirit/evaluation/pair_builder.hpp"

namespace unirit {

/// What the command line of unirit_pairs asks for.
struct PairsOptions {
  std::vector<std::string> data;     ///< folders of organ surfaces
  std::vector<std::string> exclude;  ///< organ classes left out
  int phantoms = 0;                  ///< patients of each phantom organ
  std::string output;                ///< the pair set; the manifest lies beside it
  std::string divergences;           ///< file for the table of organ against organ; empty: none
  DivergenceSettings divergence;     ///< of that table
  double unit = 0.001;               ///< of the surfaces' files [m]
  PairSettings settings;
};

struct ParsedPairsOptions {
  PairsOptions options;
  int exit_status = -1;  ///< not negative: the tool is to end with it
};

/// Prints help or a sentence on unusable arguments.
ParsedPairsOptions parsePairsOptions(int argc, char** argv);

}  // namespace unirit
