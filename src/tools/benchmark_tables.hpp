// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "benchmark_records.hpp"

namespace unirit {

/// Tables of means over cases, per protocol: methods against metrics, methods against organs; each
/// says what was computed, from what and where.
std::string toMarkdown(const std::vector<BenchmarkRecord>& records);

/// The same figures, for programs.
std::string toJson(const std::vector<BenchmarkRecord>& records);

}  // namespace unirit
