// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark_run.hpp"

#include <time.h>

#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "../atomic_file.hpp"
#include "benchmark_cases.hpp"
#include "unirit/evaluation/method_factory.hpp"
#include "unirit/io/surface_io.hpp"

namespace unirit {
namespace {

double threadMilliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// "LABEL@NAME:KEY=VALUE" is a method under a label of its own.
struct Described {
  std::string label;  // empty: the method's own name
  std::string description;

  explicit Described(const std::string& text) : description(text) {
    const std::size_t at = text.substr(0, text.find(':')).find('@');
    if (at == std::string::npos) return;
    label = text.substr(0, at);
    description = text.substr(at + 1);
  }
};

void writeClouds(const BenchmarkCase& problem, const RegistrationPair& pair,
                 const std::string& method, const MethodResult& result, const std::string& output) {
  const std::string folder =
      output + "/clouds/" + problem.protocol + "/" + problem.organ + "_" + problem.subject;
  std::filesystem::create_directories(folder);
  const auto write = [&](const std::string& name, const Points& points) {
    writePly({{points, Points()}, {}}, folder + "/" + name + ".ply", 0.001);
  };
  write("source", pair.source);
  write("target", pair.target);
  write("truth", pair.truth);
  write("moved by " + method, result.source);
  if (result.deviations.size() == 0) return;
  const Eigen::RowVectorXf millimetres = 1000.0F * result.deviations;
  std::ofstream(folder + "/deviations of " + method + ".txt") << millimetres.transpose() << '\n';
}

/// What the workers share.
class Run {
 public:
  explicit Run(const BenchmarkOptions& options)
      : options_(options), machine_(machineName()), factory_(options.weights) {
    requirePlaceFor(options.output + "/tables.md");
    for (const std::string& method : options.methods) methods_.emplace_back(method);
    const std::vector<BenchmarkCase> all = benchmarkCases(options);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const auto shard = i % static_cast<std::size_t>(options.shards) + 1;
      if (shard == static_cast<std::size_t>(options.shard)) cases_.push_back(all[i]);
    }
    for (const Described& method : methods_) factory_.make(method.description, all.front().kind);
    std::filesystem::create_directories(options.output);
    const auto rows = readRecords(options.recordsPath());
    for (const BenchmarkRecord& record : rows) known_.emplace(record.key(), record);
    writeRecords(rows, options.recordsPath());
    records_.resize(cases_.size() * methods_.size());
  }

  std::vector<BenchmarkRecord> operator()() {
    std::vector<std::thread> workers;
    for (int i = 0; i < options_.threads; ++i) workers.emplace_back([this] { work(); });
    for (std::thread& worker : workers) worker.join();
    if (fault_) std::rethrow_exception(fault_);
    return records_;
  }

 private:
  void work() try {
    std::map<std::pair<std::size_t, Protocol>, std::unique_ptr<RegistrationMethod>> methods;
    for (std::size_t i = next_case_++; i < cases_.size(); i = next_case_++) {
      const RegistrationPair pair = cases_[i].load();
      for (std::size_t j = 0; j < methods_.size(); ++j) {
        auto& method = methods[{j, cases_[i].kind}];
        if (!method) method = make(j, cases_[i].kind);
        records_[i * methods_.size() + j] = record(cases_[i], pair, methods_[j].label, *method);
      }
      tell();
    }
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!fault_) fault_ = std::current_exception();
    next_case_ = cases_.size();
  }

  std::unique_ptr<RegistrationMethod> make(std::size_t method, Protocol protocol) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return factory_.make(methods_[method].description, protocol);
  }

  /// The row as known, or computed now and added to the file.
  BenchmarkRecord record(const BenchmarkCase& problem, const RegistrationPair& pair,
                         const std::string& label, RegistrationMethod& method) {
    BenchmarkRecord record;
    record.method = label.empty() ? method.name() : label;
    record.parameters = method.parameters();
    record.data = problem.data;
    record.protocol = problem.protocol;
    record.organ = problem.organ;
    record.subject = problem.subject;
    record.seed = problem.seed;
    record.points = std::to_string(pair.source.cols()) + "+" + std::to_string(pair.target.cols());
    record.machine = machine_;
    record.threads = std::to_string(options_.threads);
    const auto known = known_.find(record.key());
    if (known != known_.end()) return known->second;

    const auto start = std::chrono::steady_clock::now();
    const double cpu_start = threadMilliseconds();
    const MethodResult result = method.registerPair(pair);
    record.cpu_milliseconds = threadMilliseconds() - cpu_start;
    const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - start;
    record.milliseconds = wall.count();
    record.errors = registrationErrors(pair, result);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (options_.clouds) {
      writeClouds(problem, pair, record.method, result, options_.output);
    }
    appendRecord(record, options_.recordsPath());
    return record;
  }

  void tell() {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++done_;
    std::cerr << '\r' << done_ << " of " << cases_.size() << " cases"
              << (done_ == cases_.size() ? "\n" : "") << std::flush;
  }

  const BenchmarkOptions& options_;
  std::string machine_;
  std::vector<Described> methods_;
  std::vector<BenchmarkCase> cases_;
  std::map<std::string, BenchmarkRecord> known_;
  std::vector<BenchmarkRecord> records_;  // case by case; each written by one worker
  std::atomic<std::size_t> next_case_{0};

  std::mutex mutex_;  // guards the following, and the files
  MethodFactory factory_;
  std::size_t done_ = 0;
  std::exception_ptr fault_;
};

}  // namespace

std::vector<BenchmarkRecord> runBenchmark(const BenchmarkOptions& options) {
  return Run(options)();
}

std::vector<BenchmarkRecord> mergeShards(const std::string& folder) {
  if (!std::filesystem::is_directory(folder)) {
    throw std::runtime_error("\"" + folder + "\" is not a folder.");
  }
  std::set<std::string> paths;  // sorted, so that the merged file does not depend on the folder
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("cases", 0) == 0 && entry.path().extension() == ".csv") {
      paths.insert(entry.path().string());
    }
  }
  std::vector<BenchmarkRecord> merged;
  std::set<std::string> keys;
  for (const std::string& path : paths) {
    for (const BenchmarkRecord& record : readRecords(path)) {
      if (keys.insert(record.key()).second) merged.push_back(record);
    }
  }
  if (merged.empty()) throw std::runtime_error(folder + ": holds no rows to merge");
  writeRecords(merged, folder + "/cases.csv");
  return merged;
}

}  // namespace unirit
