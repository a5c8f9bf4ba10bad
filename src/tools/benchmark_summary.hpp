// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "benchmark_records.hpp"

namespace unirit {

/// Means over cases; of a metric that some cases lack, over those that have it.
struct Means {
  int cases = 0;
  std::map<std::string, double> metrics;  ///< by the names of metricNames(); absent: no case has it
};

struct MethodSummary {
  std::string method;
  std::string parameters;
  Means all;
  std::map<std::string, Means> organs;
};

struct ProtocolSummary {
  std::string protocol;
  std::vector<MethodSummary> methods;  ///< in the order of the rows
  std::map<std::string, int> organs;   ///< cases of each
  std::set<std::string> data, seeds, points, machines, threads;
};

/// The metrics in their order: millimetres, degrees, percent, milliseconds.
const std::vector<std::string>& metricNames();

std::vector<ProtocolSummary> summarise(const std::vector<BenchmarkRecord>& records);

}  // namespace unirit
