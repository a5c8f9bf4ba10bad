// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark_tables.hpp"

#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "benchmark_summary.hpp"

namespace unirit {
namespace {

struct Column {
  const char* title;
  const char* metric;
  int decimals;
};
constexpr Column kColumns[] = {{"RMSE", "rmse_mm", 1},
                               {"95 %", "p95_mm", 1},
                               {"surface", "surface_mm", 1},
                               {"target", "target_mm", 1},
                               {"chamfer", "chamfer_mm", 1},
                               {"chamfer² [mm²]", "chamfer_squared_mm2", 0},
                               {"rotation [°]", "rotation_deg", 1},
                               {"translation", "translation_mm", 1},
                               {"worse [%]", "worse_percent", 0},
                               {"refused [%]", "refused_percent", 0},
                               {"ms", "ms", 0},
                               {"CPU ms", "cpu_ms", 0}};

std::string joined(const std::set<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string rangeOf(const std::set<std::string>& seeds) {
  if (seeds.size() < 3) return joined(seeds);
  unsigned long long least = ~0ULL, most = 0;
  for (const std::string& seed : seeds) {
    least = std::min(least, std::stoull(seed));
    most = std::max(most, std::stoull(seed));
  }
  return std::to_string(least) + " to " + std::to_string(most);
}

std::string cell(const Means& means, const char* metric, int decimals) {
  const auto found = means.metrics.find(metric);
  if (found == means.metrics.end()) return "–";
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << found->second;
  return text.str();
}

void writeRule(std::ostream& text, std::size_t columns) {
  for (std::size_t i = 0; i < columns; ++i) text << "|---";
  text << "|\n";
}

void writeOrigin(std::ostream& text, const ProtocolSummary& summary) {
  text << "Data: " << joined(summary.data) << "; seeds: " << rangeOf(summary.seeds)
       << "; points: " << joined(summary.points) << "; machine: " << joined(summary.machines)
       << "; threads: " << joined(summary.threads)
       << " cases at a time, each on one. Means over cases, mm unless said otherwise.\n\n";
}

void writeMetrics(std::ostream& text, const ProtocolSummary& summary) {
  text << "| method | cases";
  for (const Column& column : kColumns) text << " | " << column.title;
  text << " |\n";
  writeRule(text, 2 + std::size(kColumns));
  for (const MethodSummary& method : summary.methods) {
    text << "| " << method.method << " | " << method.all.cases;
    for (const Column& column : kColumns) {
      text << " | " << cell(method.all, column.metric, column.decimals);
    }
    text << " |\n";
  }
}

void writeOrgans(std::ostream& text, const ProtocolSummary& summary) {
  text << "\n| RMSE (cases)";
  for (const auto& [organ, cases] : summary.organs) text << " | " << organ << " (" << cases << ")";
  text << " |\n";
  writeRule(text, 1 + summary.organs.size());
  for (const MethodSummary& method : summary.methods) {
    text << "| " << method.method;
    for (const auto& [organ, cases] : summary.organs) {
      const auto found = method.organs.find(organ);
      text << " | " << (found == method.organs.end() ? "–" : cell(found->second, "rmse_mm", 1));
    }
    text << " |\n";
  }
}

nlohmann::ordered_json toJson(const Means& means) {
  nlohmann::ordered_json json{{"cases", means.cases}};
  for (const std::string& name : metricNames()) {
    const auto found = means.metrics.find(name);
    json[name] = nullptr;
    if (found != means.metrics.end()) json[name] = found->second;
  }
  return json;
}

}  // namespace

std::string toMarkdown(const std::vector<BenchmarkRecord>& records) {
  std::ostringstream text;
  for (const ProtocolSummary& summary : summarise(records)) {
    text << "## " << summary.protocol << "\n\n";
    writeOrigin(text, summary);
    writeMetrics(text, summary);
    writeOrgans(text, summary);
    text << "\nParameters:\n\n";
    for (const MethodSummary& method : summary.methods) {
      if (method.parameters != "none") {
        text << "- " << method.method << ": `" << method.parameters << "`\n";
      }
    }
    text << '\n';
  }
  return text.str();
}

std::string toJson(const std::vector<BenchmarkRecord>& records) {
  auto json = nlohmann::ordered_json::array();
  for (const ProtocolSummary& summary : summarise(records)) {
    auto methods = nlohmann::ordered_json::array();
    for (const MethodSummary& method : summary.methods) {
      nlohmann::ordered_json entry{{"method", method.method}, {"parameters", method.parameters}};
      entry["all"] = toJson(method.all);
      for (const auto& [organ, means] : method.organs) entry["organs"][organ] = toJson(means);
      methods.push_back(entry);
    }
    json.push_back({{"protocol", summary.protocol},
                    {"data", summary.data},
                    {"seeds", rangeOf(summary.seeds)},
                    {"points", summary.points},
                    {"machines", summary.machines},
                    {"threads", summary.threads},
                    {"methods", methods}});
  }
  return json.dump(2) + '\n';
}

}  // namespace unirit
