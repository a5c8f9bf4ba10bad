// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <string>
#include <vector>

#include "benchmark_options.hpp"
#include "benchmark_records.hpp"

namespace unirit {

/// Computes the rows of the options' shard that its file lacks, adds each to the file as it is
/// done, and returns all that the options ask for, in the order of cases and methods. Throws
/// std::runtime_error or std::invalid_argument with a sentence; rows done by then stay.
std::vector<BenchmarkRecord> runBenchmark(const BenchmarkOptions& options);

/// All rows of all shards in the folder, each key once; writes them to cases.csv.
std::vector<BenchmarkRecord> mergeShards(const std::string& folder);

}  // namespace unirit
