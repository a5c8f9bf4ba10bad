// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include "unirit/evaluation/trial.hpp"
#include "unirit/network/weights.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

/// The tool, run on phantoms in a folder of its own, with a network that knows nothing.
class RefusalsTool : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("unirit_refusals_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    writeWeights(randomWeights(NetworkSettings().pairing, 1),
                 (folder_ / "random.safetensors").string());
  }
  void TearDown() override { fs::remove_all(folder_); }

  int shell(const std::string& command) const {
    const int status =
        std::system(("cd " + folder_.string() + " && " + command + " >stdout 2>stderr").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  int run(const std::string& arguments) const {
    return shell(UNIRIT_REFUSALS " --weights random.safetensors " + arguments);
  }
  std::string text(const std::string& name) const {
    std::ostringstream bytes;
    bytes << std::ifstream(folder_ / name, std::ios::binary).rdbuf();
    return bytes.str();
  }

  using Row = std::map<std::string, std::string>;  // fields by the names of their columns
  std::vector<Row> rows(const std::string& name) const {
    std::istringstream file(text(name));
    std::string line;
    std::getline(file, line);
    const std::vector<std::string> names = split(line);
    std::vector<Row> rows;
    while (std::getline(file, line)) {
      const std::vector<std::string> fields = split(line);
      EXPECT_EQ(fields.size(), names.size()) << line;
      Row row;
      for (std::size_t i = 0; i < std::min(fields.size(), names.size()); ++i) {
        row[names[i]] = fields[i];
      }
      rows.push_back(row);
    }
    return rows;
  }

  static std::vector<std::string> split(const std::string& line) {
    std::istringstream stream(line + ',');
    std::vector<std::string> fields;
    for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
    return fields;
  }

  static constexpr const char* kSmall = "--phantoms 1 --points 100 ";

  fs::path folder_;
};

TEST_F(RefusalsTool, WritesARowForEveryTrialWithTheValueOfEveryCheck) {
  ASSERT_EQ(run(std::string(kSmall) + "--output out"), 0) << text("stderr");
  const auto registrations = rows("out/registrations.csv"), limits = rows("out/limits.csv");
  ASSERT_GT(limits.size(), 20U);
  std::map<std::string, int> kinds;
  for (const Row& row : registrations) {
    ++kinds[row.at("kind")];
    EXPECT_NE(row.at("organ"), split(row.at("other"))[0]);
    for (const Row& limit : limits) EXPECT_EQ(row.count(limit.at("check")), 1U);
    if (row.at("kind") == "wrong unit") {
      EXPECT_EQ(row.at("status"), "INVALID_INPUT");
      EXPECT_EQ(row.at("rmse_mm"), "");
      EXPECT_EQ(row.at("right"), "no");
    }
    if (row.at("kind") == "ordinary" && row.at("status") != "INVALID_INPUT") {
      EXPECT_NE(row.at("surprise of the displacement"), "");
      const bool near = std::stod(row.at("rmse_mm")) <= 0.1 * std::stod(row.at("extent_mm")) &&
                        std::stod(row.at("rmse_mm")) <= 1.1 * std::stod(row.at("before_mm"));
      EXPECT_EQ(row.at("right"), near ? "yes" : "no");
    }
  }
  ASSERT_EQ(kinds.size(), 7U);
  const auto protocols = static_cast<int>(ordinaryProtocols().size());
  EXPECT_EQ(kinds["ordinary"], protocols * kinds["table top"]);
  for (const char* kind : {"other organ", "wrong unit", "far start", "small view", "half other"}) {
    EXPECT_EQ(kinds[kind], kinds["table top"]) << kind;
  }
}

TEST_F(RefusalsTool, WritesTheSameRowsOnAnyNumberOfThreadsAndOthersForAnotherSeed) {
  ASSERT_EQ(run(std::string(kSmall) + "--threads 1 --output one"), 0) << text("stderr");
  ASSERT_EQ(run(std::string(kSmall) + "--threads 3 --output three"), 0) << text("stderr");
  EXPECT_EQ(text("one/registrations.csv"), text("three/registrations.csv"));
  ASSERT_EQ(run(std::string(kSmall) + "--seed 2 --output other"), 0) << text("stderr");
  EXPECT_NE(text("one/registrations.csv"), text("other/registrations.csv"));
}

TEST_F(RefusalsTool, TakesLimitsFromAFile) {
  std::ofstream(folder_ / "strict.yaml") << "plausibility: {max_turn: 0}\n";
  ASSERT_EQ(run(std::string(kSmall) + "--settings strict.yaml --output strict"), 0)
      << text("stderr");
  for (const Row& row : rows("strict/registrations.csv")) EXPECT_NE(row.at("status"), "SUCCEEDED");
}

TEST_F(RefusalsTool, RefusesFaultyRequestsInASentence) {
  const auto refuses = [&](const std::string& arguments, const std::string& words) {
    EXPECT_EQ(run(arguments), 2) << arguments;
    EXPECT_NE(text("stderr").find(words), std::string::npos) << text("stderr");
  };
  refuses("", "one of --data, --phantoms");
  refuses("--data nowhere", "nowhere");
  fs::create_directories(folder_ / "empty");
  refuses("--data empty", "organs of at least two classes are needed");
  refuses("--phantoms 0", "--phantoms");
  refuses(std::string(kSmall) + "--settings missing.yaml", "missing.yaml");
  EXPECT_EQ(shell(UNIRIT_REFUSALS " --phantoms 1"), 2);
  EXPECT_NE(text("stderr").find("--weights"), std::string::npos);
}

TEST_F(RefusalsTool, ItsFilesAreWhatTheScriptReads) {
  const std::string script = UNIRIT_PYTHON " " UNIRIT_SOURCE_DIR "/scripts/plot_refusals.py ";
  if (shell(UNIRIT_PYTHON " -c 'import numpy, matplotlib'") != 0) {
    GTEST_SKIP() << "numpy and matplotlib are not installed";
  }
  ASSERT_EQ(run(std::string(kSmall) + "--output out"), 0) << text("stderr");
  ASSERT_EQ(shell(script + "out --plots plots"), 0) << text("stderr");
  for (const char* words :
       {"| all ordinary |", "| wrong unit | ", " 0.0 % (0.0 to ", "| all failures |"}) {
    EXPECT_NE(text("stdout").find(words), std::string::npos) << words;
  }
  EXPECT_TRUE(fs::exists(folder_ / "plots/refusals.png"));
  EXPECT_TRUE(fs::exists(folder_ / "plots/refusals.svg"));
  EXPECT_EQ(shell(script + "nowhere"), 1);
  EXPECT_NE(text("stderr").find("nowhere is no output of unirit_refusals"), std::string::npos);

  // New limits go to the four places where defaults stand
  const std::vector<std::string> places{"include/unirit/settings.hpp", "config/unirit.yaml",
                                        "cfg/Unirit.cfg", "README.md"};
  for (const std::string& place : places) {
    fs::create_directories((folder_ / "tree" / place).parent_path());
    fs::copy(fs::path(UNIRIT_SOURCE_DIR) / place, folder_ / "tree" / place);
  }
  ASSERT_EQ(shell(script + "out --set-limits --tree tree"), 0) << text("stderr");
  const std::string printed = text("stdout");
  const std::size_t found = printed.find("  max_surprise: ");
  ASSERT_NE(found, std::string::npos);
  const std::string line = printed.substr(found, printed.find('\n', found) - found);
  EXPECT_NE(text("tree/config/unirit.yaml").find(line + " "), std::string::npos) << line;
  const std::string limit = line.substr(line.find(':') + 2);
  EXPECT_NE(text("tree/" + places[0]).find("max_surprise = " + limit + ";"), std::string::npos);
  EXPECT_NE(text("tree/" + places[2]).find(", " + limit + ", 0.0, 10.0)"), std::string::npos);
  EXPECT_NE(text("tree/" + places[3]).find("max_surprise` | " + limit + " |"), std::string::npos);
}

}  // namespace
}  // namespace unirit
