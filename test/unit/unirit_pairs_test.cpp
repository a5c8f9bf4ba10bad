// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "unirit/evaluation/pair_set.hpp"
#include "unirit/hash.hpp"
#include "unirit/io/surface_io.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// A flat folder of downloads, good and bad ones, and the tool run in the folder that holds it.
class PairsTool : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("unirit_pairs_" + std::to_string(::getpid()));
    fs::create_directories(folder_ / "flat");
    const auto write = [&](const char* name, const char* organ, std::uint64_t patient) {
      writePly(makePhantom(organ, patient, 900), (folder_ / "flat" / name).string(), 0.001);
    };
    write("s0001_liver.ply", "liver", 1);
    write("s0002_Kidney_left.ply", "kidney", 2);
    write("s0003_liver.ply", "gallbladder", 3);
    write("s0004_liver_spleen.ply", "liver", 4);
    std::ofstream(folder_ / "flat/s0005_spleen.stl") << "solid nothing";
  }
  void TearDown() override { fs::remove_all(folder_); }

  int run(const std::string& arguments) const {
    const std::string command =
        "cd " + folder_.string() + " && " UNIRIT_PAIRS " " + arguments + " >stdout 2>stderr";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string text(const char* name) const {
    std::ostringstream bytes;
    bytes << std::ifstream(folder_ / name, std::ios::binary).rdbuf();
    return bytes.str();
  }
  std::string at(const char* name) const { return (folder_ / name).string(); }

  static constexpr const char* kSmall =
      "--data flat --output pairs.safetensors --points 64 --surface-samples 100 ";

  fs::path folder_;
};

TEST_F(PairsTool, MakesPairsOfTheGoodFilesAndNamesTheBadOnes) {
  ASSERT_EQ(run(std::string(kSmall) + "--protocols all"), 0) << text("stderr");
  const PairSet set = readPairSet(at("pairs.safetensors"));
  EXPECT_EQ(set.protocols, allProtocols());
  ASSERT_EQ(set.cases.size(), 2U);
  EXPECT_EQ(set.cases[0].organ, "liver");
  EXPECT_EQ(set.cases[1].organ, "kidney");
  EXPECT_EQ(set.cases[1].subject, "s0002_Kidney_left");
  const std::string told = text("stderr");
  for (const char* words : {"s0003_liver.ply: is", "not plausible for liver",
                            "s0004_liver_spleen.ply: its name is "
                            "ambiguous",
                            "s0005_spleen.stl", "4 of 4 organs"}) {
    EXPECT_NE(told.find(words), std::string::npos) << words << "\n" << told;
  }
}

TEST_F(PairsTool, WritesAManifestThatTellsWhereEachPairCameFrom) {
  ASSERT_EQ(run(std::string(kSmall) + "--seed 9 --protocols caseb,intraop"), 0) << text("stderr");
  const Json manifest = Json::parse(text("pairs.json"));
  EXPECT_EQ(manifest["seed"], 9);
  EXPECT_EQ(manifest["cases"], 2);
  EXPECT_EQ(manifest["sha256"], sha256Hex(text("pairs.safetensors")));
  EXPECT_EQ(manifest["protocols"]["caseb"]["rotation_degrees"], 45.0);
  EXPECT_EQ(manifest["protocols"]["intraop"]["noise_mm"], 1.5);
  EXPECT_EQ(manifest["screening"]["lengths_mm"]["liver"], Json({130.0, 380.0}));
  ASSERT_EQ(manifest["sources"].size(), 4U);
  EXPECT_EQ(manifest["sources"][0]["sha256"], sha256Hex(text("flat/s0001_liver.ply")));
  EXPECT_EQ(manifest["sources"][0]["cases"], 1);
  EXPECT_EQ(manifest["sources"][2]["rejected"].size(), 1U);
  EXPECT_EQ(manifest["left_out"].size(), 1U);
}

TEST_F(PairsTool, WritesTheSameBytesOnAnyNumberOfThreads) {
  const std::string small = std::string(kSmall) + "--variations 1 --deformations 2 --phantoms 1 ";
  ASSERT_EQ(run(small + "--threads 1"), 0) << text("stderr");
  const std::string one = text("pairs.safetensors");
  ASSERT_EQ(run(small + "--threads 3"), 0) << text("stderr");
  EXPECT_TRUE(one == text("pairs.safetensors"));
  ASSERT_EQ(run(small + "--threads 3 --seed 2"), 0) << text("stderr");
  EXPECT_FALSE(one == text("pairs.safetensors"));
}

TEST_F(PairsTool, MakesTheFolderOfItsOutputOnceThereIsSomethingToWrite) {
  const std::string into = "--data flat --points 64 --output new/folder/pairs.safetensors ";
  ASSERT_EQ(run(into + "--min-faces 100000"), 2);
  EXPECT_FALSE(fs::exists(folder_ / "new"));
  ASSERT_EQ(run(into), 0) << text("stderr");
  EXPECT_TRUE(fs::exists(folder_ / "new/folder/pairs.json"));
}

TEST_F(PairsTool, ScreensByTheLimitsGiven) {
  ASSERT_EQ(run(std::string(kSmall) + "--length liver=30:380 --exclude kidney"), 0);
  EXPECT_EQ(readPairSet(at("pairs.safetensors")).cases.size(), 2U);  // the small liver too
  ASSERT_EQ(run(std::string(kSmall) + "--min-faces 100000"), 2);
  EXPECT_NE(text("stderr").find("no pair could be made"), std::string::npos) << text("stderr");
}

TEST_F(PairsTool, WritesATableOfOrganAgainstOrgan) {
  ASSERT_EQ(run(std::string(kSmall) + "--phantoms 2 --divergences table.md"), 0) << text("stderr");
  EXPECT_EQ(text("table.md").rfind("| L_mc | gallbladder | kidney | liver | spleen | stomach |", 0),
            0U)
      << text("table.md");
}

TEST_F(PairsTool, RefusesUnusableArgumentsWithASentence) {
  const std::pair<const char*, const char*> calls[] = {
      {"--data flat", "--output"},
      {"--output pairs.safetensors", "give --data FOLDER or --phantoms N"},
      {"--data none --output pairs.safetensors", "none: not a folder"},
      {"--data flat --output x --protocols caseA", "unknown protocol 'caseA'"},
      {"--data flat --output x --length liver=9", "is not ORGAN=LEAST:MOST"},
      {"--data flat --output x --length liver=9:3", "is not ORGAN=LEAST:MOST"},
      {"--data flat --output flat/s0001_liver.ply/pairs.safetensors", "cannot be written"},
      {"--data flat --output flat", "cannot be written"},
      {"--data flat --output pairs.json", "the name of its manifest"},
      {"--data flat --data flat --output pairs.safetensors", "lies in two of the folders"},
      {"--data empty --output pairs.safetensors", "no organ surface was found"},
  };
  fs::create_directories(folder_ / "empty");
  for (const auto& [arguments, words] : calls) {
    EXPECT_EQ(run(arguments), 2) << arguments;
    EXPECT_NE(text("stderr").find(words), std::string::npos) << text("stderr");
    EXPECT_FALSE(fs::exists(folder_ / "pairs.safetensors"));
  }
  EXPECT_EQ(run("--help"), 0);
}

}  // namespace
}  // namespace unirit
