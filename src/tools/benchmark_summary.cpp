// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark_summary.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace unirit {
namespace {

using Metric = std::pair<std::string, std::optional<double>>;

std::optional<double> scaled(const std::optional<double>& value, double factor) {
  if (!value) return std::nullopt;
  return factor * *value;
}

std::vector<Metric> metricsOf(const BenchmarkRecord& record) {
  constexpr double kMillimetres = 1000.0, kPercent = 100.0;
  const RegistrationErrors& errors = record.errors;
  return {{"rmse_mm", kMillimetres * errors.rmse},
          {"p95_mm", kMillimetres * errors.p95},
          {"surface_mm", scaled(errors.surface, kMillimetres)},
          {"target_mm", scaled(errors.target, kMillimetres)},
          {"chamfer_mm", kMillimetres * errors.chamfer},
          {"chamfer_squared_mm2", kMillimetres * kMillimetres * errors.chamfer_squared},
          {"rotation_deg", errors.rotation},
          {"translation_mm", scaled(errors.translation, kMillimetres)},
          {"worse_percent", errors.worse() ? kPercent : 0.0},
          {"refused_percent", errors.refused ? kPercent : 0.0},
          {"ms", record.milliseconds},
          {"cpu_ms", record.cpu_milliseconds}};
}

Means meansOf(const std::vector<const BenchmarkRecord*>& records) {
  Means means;
  std::map<std::string, int> counts;
  for (const BenchmarkRecord* record : records) {
    ++means.cases;
    for (const auto& [name, value] : metricsOf(*record)) {
      if (!value) continue;
      means.metrics[name] += *value;
      ++counts[name];
    }
  }
  for (auto& [name, sum] : means.metrics) sum /= counts[name];
  return means;
}

MethodSummary summariseMethod(const std::vector<const BenchmarkRecord*>& records) {
  MethodSummary summary{records.front()->method, records.front()->parameters, meansOf(records), {}};
  std::map<std::string, std::vector<const BenchmarkRecord*>> organs;
  for (const BenchmarkRecord* record : records) organs[record->organ].push_back(record);
  for (const auto& [organ, rows] : organs) summary.organs[organ] = meansOf(rows);
  return summary;
}

/// Groups what `key` calls equal, in the order of first appearance.
template <class Key>
std::vector<std::vector<const BenchmarkRecord*>> grouped(
    const std::vector<const BenchmarkRecord*>& records, Key&& key) {
  std::vector<std::vector<const BenchmarkRecord*>> groups;
  std::map<std::string, std::size_t> places;
  for (const BenchmarkRecord* record : records) {
    const auto place = places.emplace(key(*record), groups.size());
    if (place.second) groups.emplace_back();
    groups[place.first->second].push_back(record);
  }
  return groups;
}

}  // namespace

const std::vector<std::string>& metricNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const auto& [name, value] : metricsOf(BenchmarkRecord())) list.push_back(name);
    return list;
  }();
  return names;
}

std::vector<ProtocolSummary> summarise(const std::vector<BenchmarkRecord>& records) {
  std::vector<const BenchmarkRecord*> all;
  for (const BenchmarkRecord& record : records) all.push_back(&record);
  std::vector<ProtocolSummary> summaries;
  for (const auto& rows : grouped(all, [](const auto& row) { return row.protocol; })) {
    ProtocolSummary summary;
    summary.protocol = rows.front()->protocol;
    for (const BenchmarkRecord* row : rows) {
      summary.data.insert(row->data);
      summary.seeds.insert(row->seed);
      summary.points.insert(row->points);
      summary.machines.insert(row->machine);
      summary.threads.insert(row->threads);
    }
    const auto method_key = [](const auto& row) { return row.method + ',' + row.parameters; };
    for (const auto& method_rows : grouped(rows, method_key)) {
      summary.methods.push_back(summariseMethod(method_rows));
      for (const auto& [organ, means] : summary.methods.back().organs) {
        summary.organs[organ] = std::max(summary.organs[organ], means.cases);
      }
    }
    summaries.push_back(std::move(summary));
  }
  return summaries;
}

}  // namespace unirit
