// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "unirit/evaluation/errors.hpp"

namespace unirit {

/// One method on one case: a row of the benchmark's file.
struct BenchmarkRecord {
  std::string method;
  std::string parameters;
  std::string data;
  std::string protocol;
  std::string organ;
  std::string subject;
  std::string seed;
  std::string points;   ///< of source and target, "1024+1024"
  std::string machine;  ///< that computed it
  std::string threads;  ///< cases that it computed at a time
  RegistrationErrors errors;
  double milliseconds = 0.0;      ///< wall
  double cpu_milliseconds = 0.0;  ///< of the one thread that ran the method

  /// What the row answers: two rows of one key hold the same figures but for the times.
  std::string key() const;
};

/// Rows of the file, none where it does not exist. A last row cut off by an interruption is left
/// out. Throws std::runtime_error naming the file where it is no such file.
std::vector<BenchmarkRecord> readRecords(const std::string& path);

/// Replaces the file, atomically.
void writeRecords(const std::vector<BenchmarkRecord>& records, const std::string& path);

/// Adds a row to a file that writeRecords made.
void appendRecord(const BenchmarkRecord& record, const std::string& path);

/// "AMD EPYC 9B14 (2 threads)", without commas.
std::string machineName();

}  // namespace unirit
