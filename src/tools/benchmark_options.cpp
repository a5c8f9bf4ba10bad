// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark_options.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>

namespace unirit {
namespace {

void addDataOptions(CLI::App& app, BenchmarkOptions& options) {
  auto* data = app.add_option("--data", options.data,
                              "Folder of organ surfaces, ORGAN/*.{ply,stl,obj,pcd}, mm");
  auto* phantoms = app.add_option("--phantoms", options.phantoms,
                                  "Digital phantoms of each organ, in place of --data")
                       ->check(CLI::Range(1, 1000))
                       ->excludes(data);
  app.add_option(
         "--cases", options.cases,
         "Pair set of unirit_pairs, or folder PROTOCOL/ORGAN_SUBJECT/*.ply, in place of both")
      ->excludes(data)
      ->excludes(phantoms);
  app.add_option("--label", options.label,
                 "What tables call the data and its split, no commas; default: the folder's name");
  app.add_option("--exclude", options.exclude, "Organ classes left out")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--protocols", options.protocols,
                 "paired, permuted, resampled, caseb, partial, offset, intraop, camera; partial:30 "
                 "shows 30 % of the surface, intraop:30 too (not with --cases)")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--pairs", options.pairs, "Pairs of each organ")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--points", options.points, "Points of each cloud")
      ->check(CLI::Range(64, 10000))
      ->capture_default_str();
  app.add_option("--common-rotation", options.common_rotation,
                 "Turns both clouds together about random axes, by this angle [degree]")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  app.add_option("--seed", options.seed)->capture_default_str();
}

void addMethodOptions(CLI::App& app, BenchmarkOptions& options) {
  app.add_option(
         "--methods", options.methods,
         "[LABEL@]NAME[:KEY=VALUE]...; names: identity, best-rigid, icp, gicp, cpd-rigid, "
         "cpd, bcpd, unirit, unirit-rows; unirit's keys: weights=FILE, stages=rigid+nonrigid, "
         "start=centroids; a rival's keys replace its tuned settings")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--weights", options.weights, "Weights file of unirit");
}

void addRunOptions(CLI::App& app, BenchmarkOptions& options, std::string& shard) {
  app.add_option("--output", options.output,
                 "Folder of rows and tables; cases whose rows are there are not computed again")
      ->capture_default_str();
  app.add_option("--threads", options.threads, "Cases at a time; each runs on one thread")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--shard", shard, "I/N: computes every N-th case alone, to be merged");
  app.add_flag("--merge", options.merge, "Computes nothing, merges the shards in --output");
  app.add_flag("--clouds", options.clouds,
               "Writes the clouds of every case computed, too, and the deviations that methods "
               "expect of their points");
}

void parseShard(const std::string& text, BenchmarkOptions& options) {
  char end = '\0';
  if (std::sscanf(text.c_str(), "%d/%d%c", &options.shard, &options.shards, &end) != 2 ||
      options.shard < 1 || options.shard > options.shards) {
    throw CLI::ValidationError("--shard", "must be I/N with 1 <= I <= N");
  }
}

}  // namespace

std::string BenchmarkOptions::recordsPath() const {
  const std::string part =
      shards == 1 ? "" : "-" + std::to_string(shard) + "of" + std::to_string(shards);
  return output + "/cases" + part + ".csv";
}

std::optional<BenchmarkOptions> parseBenchmarkOptions(int argc, char** argv, int& exit_status) {
  CLI::App app{"Registers cases whose truth is known by several methods, writes tables of errors."};
  BenchmarkOptions options;
  std::string shard;
  addDataOptions(app, options);
  addMethodOptions(app, options);
  addRunOptions(app, options, shard);
  try {
    app.parse(argc, argv);
    if (!shard.empty()) parseShard(shard, options);
    if (options.label.find(',') != std::string::npos) {
      throw CLI::ValidationError("--label", "must not hold a comma");
    }
    if (!options.merge && options.data.empty() && options.cases.empty() && options.phantoms == 0) {
      throw CLI::RequiredError("one of --data, --phantoms, --cases, --merge");
    }
  } catch (const CLI::ParseError& error) {
    exit_status = app.exit(error) == 0 ? 0 : 2;
    return std::nullopt;
  }
  return options;
}

}  // namespace unirit
