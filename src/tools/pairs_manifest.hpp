// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "pairs_options.hpp"

namespace unirit {

/// Everything that is needed to make the set again, and what became of each file, as JSON text.
/// `left_out`: sentences on files that were no source at all.
std::string pairsManifest(const PairsOptions& options, const BuiltPairs& pairs,
                          const std::vector<std::string>& left_out, const std::string& set_sha256);

}  // namespace unirit
