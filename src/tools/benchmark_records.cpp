// SPDX-License-Identifier: BSD-3-Clause
#include "benchmark_records.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace unirit {
namespace {

constexpr double kMillimetres = 1000.0;
constexpr double kSquareMillimetres = 1e6;

/// The one list of columns: visitor(name, text) and visitor(name, number, unit's factor).
template <class Record, class Visitor>
void visitColumns(Record& record, Visitor&& visitor) {
  visitor("method", record.method);
  visitor("parameters", record.parameters);
  visitor("data", record.data);
  visitor("protocol", record.protocol);
  visitor("organ", record.organ);
  visitor("subject", record.subject);
  visitor("seed", record.seed);
  visitor("points", record.points);
  visitor("machine", record.machine);
  visitor("threads", record.threads);
  auto& errors = record.errors;
  visitor("refused", errors.refused, 1.0);
  visitor("before_mm", errors.before, kMillimetres);
  visitor("best_rigid_mm", errors.best_rigid, kMillimetres);
  visitor("rmse_mm", errors.rmse, kMillimetres);
  visitor("p95_mm", errors.p95, kMillimetres);
  visitor("surface_mm", errors.surface, kMillimetres);
  visitor("target_mm", errors.target, kMillimetres);
  visitor("chamfer_mm", errors.chamfer, kMillimetres);
  visitor("chamfer_squared_mm2", errors.chamfer_squared, kSquareMillimetres);
  visitor("rotation_deg", errors.rotation, 1.0);
  visitor("translation_mm", errors.translation, kMillimetres);
  visitor("pose_mm", errors.pose, kMillimetres);
  visitor("ms", record.milliseconds, 1.0);
  visitor("cpu_ms", record.cpu_milliseconds, 1.0);
}

struct WriteName {
  std::ostream& line;
  template <class... Value>
  void operator()(const char* name, const Value&...) {
    line << (line.tellp() > 0 ? "," : "") << name;
  }
};

struct WriteValue {
  std::ostream& line;
  bool first = true;
  void separate() {
    if (!first) line << ',';
    first = false;
  }
  void operator()(const char*, const std::string& text) {
    separate();
    line << text;
  }
  void operator()(const char*, double number, double factor) {
    separate();
    line << factor * number;
  }
  void operator()(const char*, const std::optional<double>& number, double factor) {
    separate();
    if (number) line << factor * *number;
  }
};

struct ReadValue {
  std::istream& line;
  std::string next() {
    std::string field;
    if (!std::getline(line, field, ',')) throw std::out_of_range("too few columns");
    return field;
  }
  void operator()(const char*, std::string& text) { text = next(); }
  void operator()(const char*, bool& flag, double) { flag = next() == "1"; }
  void operator()(const char*, double& number, double factor) {
    number = std::stod(next()) / factor;
  }
  void operator()(const char*, std::optional<double>& number, double factor) {
    const std::string field = next();
    if (!field.empty()) number = std::stod(field) / factor;
  }
};

std::string header() {
  std::ostringstream line;
  const BenchmarkRecord any;
  visitColumns(any, WriteName{line});
  return line.str();
}

std::string toLine(const BenchmarkRecord& record) {
  std::ostringstream line;
  line.precision(9);
  visitColumns(record, WriteValue{line});
  return line.str();
}

}  // namespace

std::string BenchmarkRecord::key() const {
  return method + ',' + parameters + ',' + data + ',' + protocol + ',' + organ + ',' + subject +
         ',' + seed + ',' + points;
}

std::vector<BenchmarkRecord> readRecords(const std::string& path) {
  std::ifstream file(path);
  std::vector<BenchmarkRecord> records;
  std::string line;
  if (!file || !std::getline(file, line)) return records;
  if (line != header()) throw std::runtime_error(path + ": is no file of the benchmark's rows");
  while (std::getline(file, line)) {
    if (file.eof()) break;  // no line end: the row was cut off
    try {
      std::istringstream fields(line + ',');
      BenchmarkRecord record;
      visitColumns(record, ReadValue{fields});
      records.push_back(record);
    } catch (const std::logic_error&) {
      throw std::runtime_error(path + ": row " + std::to_string(records.size() + 2) +
                               " is damaged");
    }
  }
  return records;
}

void writeRecords(const std::vector<BenchmarkRecord>& records, const std::string& path) {
  const std::string draft = path + ".part";
  std::ofstream file(draft);
  file << header() << '\n';
  for (const BenchmarkRecord& record : records) file << toLine(record) << '\n';
  file.close();
  if (!file || std::rename(draft.c_str(), path.c_str()) != 0) {
    throw std::runtime_error(path + ": cannot be written");
  }
}

void appendRecord(const BenchmarkRecord& record, const std::string& path) {
  std::ofstream file(path, std::ios::app);
  file << toLine(record) + '\n';
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

std::string machineName() {
  std::ifstream information("/proc/cpuinfo");
  std::string name = "unknown processor";
  for (std::string line; std::getline(information, line);) {
    if (line.rfind("model name", 0) == 0) {
      name = line.substr(line.find(':') + 2);
      break;
    }
  }
  std::replace(name.begin(), name.end(), ',', ' ');
  return name + " (" + std::to_string(std::thread::hardware_concurrency()) + " threads)";
}

}  // namespace unirit
