// SPDX-License-Identifier: BSD-3-Clause
// Command line of the benchmark: cases and methods in, rows and tables of errors out.
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "benchmark_options.hpp"
#include "benchmark_run.hpp"
#include "benchmark_tables.hpp"

namespace {

using namespace unirit;  // NOLINT

void write(const std::string& text, const std::string& path) {
  std::ofstream file(path);
  file << text;
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

void run(const BenchmarkOptions& options) {
  const std::vector<BenchmarkRecord> records =
      options.merge ? mergeShards(options.output) : runBenchmark(options);
  if (options.shards > 1) return;  // the tables are made when the shards are merged
  const std::string tables = toMarkdown(records);
  write(tables, options.output + "/tables.md");
  write(toJson(records), options.output + "/tables.json");
  std::cout << tables;
}

}  // namespace

int main(int argc, char** argv) try {
  int exit_status = 0;
  const auto options = parseBenchmarkOptions(argc, argv, exit_status);
  if (options) run(*options);
  return exit_status;
} catch (const std::exception& error) {
  std::cerr << "unirit_benchmark: " << error.what() << '\n';
  return 2;
}
