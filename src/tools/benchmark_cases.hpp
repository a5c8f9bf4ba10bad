// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "benchmark_options.hpp"
#include "unirit/evaluation/pair.hpp"

namespace unirit {

/// A registration problem before it is read or made.
struct BenchmarkCase {
  std::string data;
  std::string protocol;                 ///< as asked for: "partial:30"
  Protocol kind = Protocol::kPermuted;  ///< methods are tuned for it
  std::string organ;
  std::string subject;
  std::string seed;  ///< "stored" where the case is read from files
  std::function<RegistrationPair()> load;
};

/// The cases that the options ask for, of all shards, always in the same order. Throws
/// std::runtime_error where there is none.
std::vector<BenchmarkCase> benchmarkCases(const BenchmarkOptions& options);

}  // namespace unirit
