// SPDX-License-Identifier: BSD-3-Clause
// Measures what the plausibility checks refuse: registrations that should succeed and that should
// not, a row for each.
#include <atomic>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stdexcept>
#include <thread>

#include "chosen_organs.hpp"
#include "refusals_options.hpp"
#include "unirit/evaluation/trial.hpp"
#include "unirit/io/settings_yaml.hpp"
#include "unirit/registration.hpp"

namespace unirit {
namespace {

constexpr double kMillimetres = 1000.0;

/// "kidney" of kidney_tumor: with and without a tumour it is no other organ.
std::string classOf(const Organ& organ) { return organ.name.substr(0, organ.name.find("_tumor")); }

/// At most so many of each class, of at least two classes.
std::vector<Organ> organsOf(const RefusalsOptions& options) {
  std::vector<Organ> organs;
  std::map<std::string, int> counts;
  std::set<std::string> classes;
  for (Organ& organ : chosenOrgans(options.data, options.exclude, options.phantoms)) {
    if (++counts[organ.name] > options.subjects) continue;
    classes.insert(classOf(organ));
    organs.push_back(std::move(organ));
  }
  if (classes.size() < 2) {
    throw std::runtime_error(
        "organs of at least two classes are needed, so that one can be "
        "mistaken for another");
  }
  return organs;
}

struct Row {
  Trial trial;
  std::size_t organ = 0, other = 0;
  std::uint64_t seed = 0;
  Registration registration;
};

/// One round: every organ deformed anew, and all kinds of trials of it.
class Round {
 public:
  Round(const std::vector<Organ>& organs, const RefusalsOptions& options,
        std::shared_ptr<const Weights> weights, const RegistrationSettings& settings, int round)
      : organs_(organs),
        options_(options),
        weights_(std::move(weights)),
        settings_(settings),
        first_(static_cast<std::size_t>(round) * organs.size()),
        deformed_(organs.size()),
        rows_(organs.size()) {}

  /// Rows of each organ, in the sequence of the organs.
  std::vector<std::vector<Row>> operator()() {
    onThreads([this](std::size_t organ, Registrar&) {
      deformed_[organ].emplace(organs_[organ].surface, seedOf(organ));
    });
    onThreads([this](std::size_t organ, Registrar& registrar) { attempt(organ, registrar); });
    return std::move(rows_);
  }

 private:
  std::uint64_t seedOf(std::size_t organ) const {
    return options_.seed * 1000003ULL + first_ + organ;
  }

  template <class Work>
  void onThreads(const Work& work) {
    std::atomic<std::size_t> next{0};
    std::vector<std::thread> workers;
    std::exception_ptr fault;
    std::mutex mutex;  // guards the fault
    for (int i = 0; i < options_.threads; ++i) {
      workers.emplace_back([&] {
        try {
          Registrar registrar(weights_, settings_);
          for (std::size_t k = next++; k < organs_.size(); k = next++) work(k, registrar);
        } catch (...) {
          const std::lock_guard<std::mutex> lock(mutex);
          fault = std::current_exception();
          next = organs_.size();
        }
      });
    }
    for (std::thread& worker : workers) worker.join();
    if (fault) std::rethrow_exception(fault);
  }

  std::size_t otherThan(std::size_t organ, Random& random) const {
    const auto count = static_cast<std::int64_t>(organs_.size());
    auto other = static_cast<std::size_t>(random.below(count));
    while (classOf(organs_[other]) == classOf(organs_[organ])) other = (other + 1) % organs_.size();
    return other;
  }

  void attempt(std::size_t organ, Registrar& registrar) {
    Random random(seedOf(organ));
    const auto number = static_cast<int>(first_ + organ);
    for (const TrialKind kind : trialKinds()) {
      const bool ordinary = kind == TrialKind::kOrdinary;
      const std::size_t trials = ordinary ? ordinaryProtocols().size() : 1;
      for (std::size_t k = 0; k < trials; ++k) {
        Row row;
        row.organ = organ;
        row.other = otherThan(organ, random);
        row.seed = random.next();
        row.trial = makeTrial(kind, ordinary ? static_cast<int>(k) : number, *deformed_[organ],
                              *deformed_[row.other], options_.points, row.seed);
        row.registration = registrar.registerClouds(row.trial.preoperative,
                                                    row.trial.intraoperative, row.trial.guess);
        rows_[organ].push_back(std::move(row));
      }
    }
  }

  const std::vector<Organ>& organs_;
  const RefusalsOptions& options_;
  std::shared_ptr<const Weights> weights_;
  const RegistrationSettings& settings_;
  std::size_t first_;  // number of the round's first organ
  std::vector<std::optional<DeformedOrgan>> deformed_;
  std::vector<std::vector<Row>> rows_;
};

/// The files: rows as they come, then every check's limit.
class Report {
 public:
  explicit Report(const std::string& folder) : folder_(folder) {
    std::filesystem::create_directories(folder);
  }

  void add(const Row& row, const std::vector<Organ>& organs) {
    std::ostringstream line;
    const Trial& trial = row.trial;
    const Registration& registration = row.registration;
    line << toString(trial.kind) << ',' << toString(trial.protocol) << ',' << organs[row.organ].name
         << ',' << organs[row.organ].subject << ',' << organs[row.other].name << ' '
         << organs[row.other].subject << ',' << row.seed << ',' << toString(registration.status)
         << ',';
    const double extent = unirit::extent(trial.preoperative.points);
    line << kMillimetres * extent << ',';
    if (trial.truth.cols() > 0) line << kMillimetres * extent * trial.errorBefore();
    line << ',';
    bool right = false;
    if (registration.deformation) {
      const Points moved = registration.deformation->movedSurface();
      if (trial.truth.cols() > 0) line << kMillimetres * extent * trial.error(moved);
      right = trial.isRight(moved);
    }
    line << ',' << (right ? "yes" : "no");
    std::map<std::string, double> values;
    for (const PlausibilityCheck& check : registration.checks) {
      values[check.name] = check.value;
      if (limits_.emplace(check.name, check).second) names_.push_back(check.name);
    }
    rows_.push_back({line.str(), std::move(values)});
  }

  void write() const {
    std::ostringstream rows, limits;
    rows << "kind,protocol,organ,subject,other,seed,status,extent_mm,before_mm,rmse_mm,right";
    limits << "check,limit,at_least\n";
    for (const std::string& name : names_) {
      rows << ',' << name;
      const PlausibilityCheck& check = limits_.at(name);
      limits << name << ',' << check.limit << ',' << (check.at_least ? "yes" : "no") << '\n';
    }
    rows << '\n';
    for (const auto& [line, values] : rows_) {
      rows << line;
      for (const std::string& name : names_) {
        rows << ',';
        const auto value = values.find(name);
        if (value != values.end()) rows << value->second;
      }
      rows << '\n';
    }
    save(rows.str(), "registrations.csv");
    save(limits.str(), "limits.csv");
  }

 private:
  void save(const std::string& text, const std::string& name) const {
    const std::string path = folder_ + "/" + name;
    std::ofstream file(path);
    file << text;
    if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
  }

  std::string folder_;
  std::vector<std::pair<std::string, std::map<std::string, double>>> rows_;
  std::vector<std::string> names_;  // of checks, as they were met
  std::map<std::string, PlausibilityCheck> limits_;
};

void run(const RefusalsOptions& options) {
  const auto weights = std::make_shared<const Weights>(readWeights(options.weights));
  RegistrationSettings settings;
  settings.network.pairing = weights->pairing;
  if (!options.settings.empty()) readSettings(options.settings, settings);
  settings.threads = 1;
  Report report(options.output);
  const std::vector<Organ> organs = organsOf(options);
  for (int round = 0; round < options.rounds; ++round) {
    for (const auto& rows : Round(organs, options, weights, settings, round)()) {
      for (const Row& row : rows) report.add(row, organs);
    }
    std::cerr << "round " << round + 1 << " of " << options.rounds << '\n';
    report.write();
  }
}

}  // namespace
}  // namespace unirit

int main(int argc, char** argv) try {
  int exit_status = 0;
  const auto options = unirit::parseRefusalsOptions(argc, argv, exit_status);
  if (options) unirit::run(*options);
  return exit_status;
} catch (const std::exception& error) {
  std::cerr << "unirit_refusals: " << error.what() << '\n';
  return 2;
}
