// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "unirit/io/surface_io.hpp"
#include "unirit/network/weights.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

/// The tool, run on phantoms in a folder of its own.
class BenchmarkTool : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("unirit_benchmark_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  int run(const std::string& arguments) const {
    const std::string command =
        "cd " + folder_.string() + " && " UNIRIT_BENCHMARK " " + arguments + " >stdout 2>stderr";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string text(const std::string& name) const {
    std::ostringstream bytes;
    bytes << std::ifstream(folder_ / name, std::ios::binary).rdbuf();
    return bytes.str();
  }
  void overwrite(const std::string& name, const std::string& content) const {
    std::ofstream(folder_ / name, std::ios::binary) << content;
  }

  /// Rows but for what differs from run to run: machine, threads, milliseconds.
  std::set<std::string> figures(const std::string& name) const {
    std::istringstream file(text(name));
    std::set<std::string> rows;
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
      std::istringstream fields(line + ',');
      std::string kept, field;
      for (int column = 0; std::getline(fields, field, ','); ++column) {
        if (column != 8 && column != 9 && column < 22) kept += field + ',';
      }
      rows.insert(kept);
    }
    return rows;
  }

  static constexpr const char* kSmall =
      "--phantoms 1 --points 100 --protocols caseb,partial --methods identity,best-rigid,icp ";

  fs::path folder_;
};

TEST_F(BenchmarkTool, WritesARowForEveryCaseAndMethodAndTablesOfThem) {
  ASSERT_EQ(run(std::string(kSmall) + "--output out"), 0) << text("stderr");
  const auto json = nlohmann::json::parse(text("out/tables.json"));
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0]["protocol"], "caseb");
  EXPECT_EQ(json[0]["methods"].size(), 3U);
  std::size_t cases = 0;
  for (const auto& protocol : json) {
    for (const auto& method : protocol["methods"]) cases += method["all"]["cases"].get<int>();
    const double oracle = protocol["methods"][1]["all"]["rmse_mm"];
    EXPECT_LT(oracle, protocol["methods"][0]["all"]["rmse_mm"]);
    EXPECT_LE(oracle, protocol["methods"][2]["all"]["rmse_mm"]);
  }
  EXPECT_EQ(figures("out/cases.csv").size(), cases);
  const std::string table = text("out/tables.md");
  for (const char* words : {"Data: phantoms; seeds: ", "points: 100+100", "machine: ", "threads: 2",
                            "| best-rigid (oracle) |", "- icp: `max_distance="}) {
    EXPECT_NE(table.find(words), std::string::npos) << words;
  }
  EXPECT_EQ(table, text("stdout"));
}

TEST_F(BenchmarkTool, GoesOnWhereItWasCutOff) {
  const std::string command = std::string(kSmall) + "--output out";
  ASSERT_EQ(run(command), 0) << text("stderr");
  const auto complete = figures("out/cases.csv");

  const std::string rows = text("out/cases.csv");
  overwrite("out/cases.csv", rows.substr(0, rows.size() - 20));  // within the last row
  ASSERT_EQ(run(command), 0) << text("stderr");
  EXPECT_EQ(figures("out/cases.csv"), complete);
}

TEST_F(BenchmarkTool, ComputesNoKnownRowAgain) {
  const std::string command = "--phantoms 1 --points 100 --protocols caseb --methods identity ";
  ASSERT_EQ(run(command + "--output out"), 0) << text("stderr");
  std::istringstream file(text("out/cases.csv"));
  std::string header, row;
  std::getline(file, header);
  std::getline(file, row);
  std::string known;  // the first row, its 14th column (RMSE) replaced by a mark
  std::istringstream fields(row);
  std::string field;
  for (int column = 0; std::getline(fields, field, ','); ++column) {
    known += (column > 0 ? "," : "") + (column == 13 ? "12345" : field);
  }
  overwrite("out/cases.csv", header + '\n' + known + '\n');
  ASSERT_EQ(run(command + "--output out"), 0) << text("stderr");
  EXPECT_NE(text("out/cases.csv").find(",12345,"), std::string::npos);
}

TEST_F(BenchmarkTool, ShardsMergeToTheWholeOnAnyNumberOfThreads) {
  ASSERT_EQ(run(std::string(kSmall) + "--output whole --threads 3"), 0) << text("stderr");
  for (const char* shard : {"1/3", "2/3", "3/3"}) {
    ASSERT_EQ(run(std::string(kSmall) + "--output parts --threads 1 --shard " + shard), 0);
  }
  ASSERT_EQ(run("--merge --output parts"), 0) << text("stderr");
  EXPECT_EQ(figures("parts/cases.csv"), figures("whole/cases.csv"));
  const auto parts = nlohmann::json::parse(text("parts/tables.json"));
  EXPECT_EQ(parts.size(), 2U);
}

TEST_F(BenchmarkTool, TablesNameTheWeights) {
  writeWeights(randomWeights(NetworkSettings().pairing, 1),
               (folder_ / "random.safetensors").string());
  ASSERT_EQ(run("--phantoms 1 --points 64 --protocols caseb --weights random.safetensors "
                "--methods unirit:stages=rigid,fpt@unirit:stages=nonrigid --output out"),
            0)
      << text("stderr");
  const std::string hash = readWeights((folder_ / "random.safetensors").string()).sha256;
  EXPECT_NE(text("out/tables.md").find("- unirit rigid: `weights=" + hash), std::string::npos);
  EXPECT_NE(text("out/tables.md").find("| fpt |"), std::string::npos);
}

TEST_F(BenchmarkTool, ShowsTheShareThatAProtocolNames) {
  const std::string command = "--phantoms 1 --points 100 --methods identity,icp --clouds ";
  ASSERT_EQ(run(command + "--protocols partial,partial:40,partial:10 --output out"), 0)
      << text("stderr");
  const auto json = nlohmann::json::parse(text("out/tables.json"));
  ASSERT_EQ(json.size(), 3U);
  EXPECT_EQ(json[0]["protocol"], "partial");
  EXPECT_EQ(json[1]["protocol"], "partial:40");
  EXPECT_EQ(json[2]["protocol"], "partial:10");
  for (const char* metric : {"rmse_mm", "chamfer_mm"}) {
    const auto icp = [&](int protocol) { return json[protocol]["methods"][1]["all"][metric]; };
    EXPECT_EQ(icp(0), icp(1)) << "the protocol shows 40 %";
    EXPECT_NE(icp(0), icp(2));
  }
  for (const auto& entry : fs::directory_iterator(folder_ / "out/clouds/partial:10")) {
    const auto extentOf = [&](const std::string& protocol) {
      return extent(
          readSurface(
              (folder_ / "out/clouds" / protocol / entry.path().filename() / "target.ply").string(),
              0.001)
              .surface.vertices.points);
    };
    EXPECT_LT(extentOf("partial:10"), extentOf("partial")) << entry.path();
  }
}

TEST_F(BenchmarkTool, WritesCloudsWhereAsked) {
  ASSERT_EQ(run("--phantoms 1 --points 64 --protocols caseb --methods identity --clouds "
                "--output out"),
            0)
      << text("stderr");
  std::size_t cases = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "out/clouds/caseb")) {
    ++cases;
    for (const char* name : {"source.ply", "target.ply", "truth.ply", "moved by identity.ply"}) {
      EXPECT_TRUE(fs::exists(entry.path() / name)) << name;
    }
  }
  EXPECT_EQ(cases, figures("out/cases.csv").size());
}

TEST_F(BenchmarkTool, WritesTheDeviationsThatAMethodExpects) {
  writeWeights(randomWeights(NetworkSettings().pairing, 1),
               (folder_ / "random.safetensors").string());
  ASSERT_EQ(run("--phantoms 1 --points 200 --protocols resampled --weights random.safetensors "
                "--methods identity,ours@unirit:stages=refine --clouds --output out"),
            0)
      << text("stderr");
  std::size_t told = 0;
  for (const auto& entry : fs::directory_iterator(folder_ / "out/clouds/resampled")) {
    const fs::path base = fs::path("out/clouds/resampled") / entry.path().filename();
    EXPECT_FALSE(fs::exists(folder_ / base / "deviations of identity.txt"));
    const fs::path file = base / "deviations of ours.txt";
    if (!fs::exists(folder_ / file)) continue;  // refused
    ++told;
    std::istringstream lines(text(file));
    std::size_t points = 0;
    for (double deviation = 0.0; lines >> deviation; ++points) {
      EXPECT_GT(deviation, 0.0);
      EXPECT_LT(deviation, 20.0) << "mm: the prior's, of a phantom";
    }
    EXPECT_EQ(points, 200U) << base;
  }
  EXPECT_GT(told, 0U);
}

TEST_F(BenchmarkTool, RefusesFaultyRequestsInASentence) {
  const auto refuses = [&](const std::string& arguments, const std::string& words) {
    EXPECT_EQ(run(arguments), 2) << arguments;
    EXPECT_NE(text("stderr").find(words), std::string::npos) << text("stderr");
  };
  const std::string phantoms = "--phantoms 1 --points 64 --output new ";
  refuses("", "one of --data, --phantoms, --cases, --merge");
  refuses("--merge --output nowhere", "\"nowhere\" is not a folder");
  refuses(phantoms + "--methods cdp", "unknown");
  refuses(phantoms + "--methods unirit", "needs weights");
  refuses(phantoms + "--protocols caseA --methods identity", "unknown protocol 'caseA'");
  for (const char* share : {"partial:0", "partial:100", "partial:30%", "partial:", "caseb:30"}) {
    refuses(phantoms + "--methods identity --protocols " + share, std::string("'") + share + "'");
  }
  refuses(phantoms + "--shard 3/2", "--shard");
  refuses("--cases nowhere --methods identity --output new", "nowhere");
  EXPECT_FALSE(fs::exists(folder_ / "new")) << "nothing is written";
  fs::create_directories(folder_ / "bad");
  overwrite("bad/cases.csv", "something else\n");
  const std::string small = "--phantoms 1 --points 64 --methods identity --output ";
  refuses(small + "bad", "bad/cases.csv");
  refuses(small + "bad/cases.csv", "bad/cases.csv/tables.md cannot be written");
}

}  // namespace
}  // namespace unirit
