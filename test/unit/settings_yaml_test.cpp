// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/settings_yaml.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace unirit {
namespace {

class SettingsYaml : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }

  RegistrationSettings read(const std::string& text) {
    std::ofstream(path_) << text;
    RegistrationSettings settings;
    readSettings(path_, settings);
    return settings;
  }

  // The sentence the file is refused with; empty where it is read.
  std::string refusal(const std::string& text) {
    try {
      read(text);
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(path_), std::string::npos) << error.what();
      return error.what();
    }
    return {};
  }

  void expectRefusal(const std::string& text, const std::string& words) {
    EXPECT_NE(refusal(text).find(words), std::string::npos) << text << " -> " << refusal(text);
  }

  const std::string path_ = (std::filesystem::temp_directory_path() /
                             ("unirit_settings_" + std::to_string(::getpid()) + ".yaml"))
                                .string();
};

TEST_F(SettingsYaml, ReadsNestedAndJoinedKeys) {
  const RegistrationSettings settings = read(
      "threads: 3\nstages: rigid\nplausibility: {min_points: 70, max_residual: 1}\n"
      "sampling/points: 256\nnetwork:\n  pairing: none\n"
      "refinement: {correspondence: points, last_sigma: 0.03}\n");
  EXPECT_EQ(settings.threads, 3);
  EXPECT_EQ(settings.stages, std::vector<Stage>{Stage::kRigid});
  EXPECT_EQ(settings.plausibility.min_points, 70);
  EXPECT_EQ(settings.plausibility.max_residual, 1.0);
  EXPECT_EQ(settings.sampling.points, 256);
  EXPECT_EQ(settings.network.pairing, Pairing::kNone);
  EXPECT_EQ(settings.refinement.correspondence, Correspondence::kPoints);
  EXPECT_EQ(settings.refinement.last_sigma, 0.03);
}

TEST_F(SettingsYaml, KeepsWhatTheFileDoesNotName) {
  EXPECT_EQ(sha256(read("")), sha256(RegistrationSettings()));
  EXPECT_EQ(sha256(read("threads: 2\n")), sha256(RegistrationSettings()));
}

TEST_F(SettingsYaml, ReadsTheNodesOwnFile) {
  RegistrationSettings settings;
  readSettings(std::string(UNIRIT_SOURCE_DIR) + "/config/unirit.yaml", settings);
  EXPECT_EQ(sha256(settings), sha256(RegistrationSettings()))
      << "config/unirit.yaml states the defaults";
}

TEST_F(SettingsYaml, NamesTheKeyThatIsWrong) {
  expectRefusal("thread: 3\n", "thread is not a setting");
  expectRefusal("publish_rate: 3\n", "publish_rate is not a setting");
  expectRefusal("plausibility: {min_point: 3}\n", "plausibility/min_point is not a setting");
  expectRefusal("threads: many\n", "threads is not a whole number");
  expectRefusal("threads: 2.5\n", "threads is not a whole number");
  expectRefusal("threads: [2]\n", "threads is not a whole number");
  expectRefusal("threads:\n", "threads is not a whole number");
  expectRefusal("plausibility: {max_residual: true}\n",
                "plausibility/max_residual is not a number");
  expectRefusal("plausibility: {max_residual: 2}\n", "plausibility/max_residual: 2 is outside");
  expectRefusal("plausibility: {max_residual: .nan}\n", "plausibility/max_residual");
  expectRefusal("threads: 0\n", "threads: 0 is outside");
  expectRefusal("stages: refine,rigid\n", "out of order");
  expectRefusal("refinement: {correspondence: lines}\n", "unknown correspondence 'lines'");
  expectRefusal("refinement: {iterations: 0}\n", "refinement/iterations: 0 is outside");
  expectRefusal("network: {pairing: closest}\n", "closest");
  expectRefusal("threads: 2\nplausibility/min_points: 9\nplausibility: {min_points: 8}\n",
                "plausibility/min_points stands twice");
}

TEST_F(SettingsYaml, RefusesWhatIsNotASettingsFile) {
  expectRefusal("- 1\n- 2\n", "not a list of settings");
  expectRefusal("threads: [1\n", "end of sequence");
  RegistrationSettings settings;
  EXPECT_THROW(readSettings("/no/such/file.yaml", settings), std::runtime_error);
}

TEST_F(SettingsYaml, LeavesTheSettingsAloneWhenItRefuses) {
  std::ofstream(path_) << "threads: 7\nsampling: {points: 3}\n";
  RegistrationSettings settings;
  EXPECT_THROW(readSettings(path_, settings), std::runtime_error);
  EXPECT_EQ(sha256(settings), sha256(RegistrationSettings()));
}

}  // namespace
}  // namespace unirit
