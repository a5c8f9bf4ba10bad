// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/pair_set.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

constexpr Eigen::Index kPoints = 128, kSurface = 300;
const std::vector<Protocol> kProtocols{Protocol::kPaired, Protocol::kCaseB, Protocol::kPartial,
                                       Protocol::kOffset, Protocol::kCamera};

std::string contents(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

class PairSets : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = fs::temp_directory_path() / ("unirit_pair_set_" + std::to_string(::getpid()));
    fs::create_directories(folder());
    writePairSet(set(), path());
  }
  static void TearDownTestSuite() { fs::remove_all(folder()); }

  static fs::path& folder() {
    static fs::path value;
    return value;
  }
  static std::string path() { return (folder() / "pairs.safetensors").string(); }

  static const std::vector<Surface>& organs() {
    static const std::vector<Surface> value{makePhantom("kidney", 1, 700),
                                            makePhantom("liver", 2, 700)};
    return value;
  }
  static const PairSet& set() {
    static const PairSet value = [] {
      PairSet made{kProtocols, {}};
      for (const std::uint64_t seed : {7ULL, 0xFFFFFFFFFFFFFFF1ULL}) {
        const std::size_t k = made.cases.size();
        made.cases.push_back({k == 0 ? "kidney" : "liver", "Ünit \"1\"", static_cast<int>(k), 3,
                              seed,
                              makeSeenOrgan(organs()[k], kProtocols, kPoints, kSurface, seed)});
      }
      return made;
    }();
    return value;
  }

  static void expectRefusal(const std::string& bytes, const std::string& words) {
    const std::string broken = (folder() / "broken").string();
    std::ofstream(broken, std::ios::binary) << bytes;
    try {
      readPairSet(broken);
      ADD_FAILURE() << "read a file that " << words;
    } catch (const std::runtime_error& error) {
      const std::string sentence = error.what();
      EXPECT_NE(sentence.find(broken), std::string::npos) << sentence;
      EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
    }
  }

  static std::string replaced(const std::string& from, const std::string& to) {
    std::string bytes = contents(path());
    const std::size_t place = bytes.find(from);
    EXPECT_NE(place, std::string::npos) << from;
    return bytes.replace(place, from.size(), to);
  }
};

TEST_F(PairSets, GiveBackThePairsThatTheirSeedsMakeBitForBit) {
  const PairSet read = readPairSet(path());
  ASSERT_EQ(read.protocols, kProtocols);
  ASSERT_EQ(read.cases.size(), 2U);
  for (std::size_t c = 0; c < 2; ++c) {
    for (const Protocol protocol : kProtocols) {
      SCOPED_TRACE(toString(protocol));
      const RegistrationPair pair = read.pair(read.cases[c], protocol);
      const RegistrationPair made = makePair(organs()[c], protocol, kPoints, read.cases[c].seed);
      EXPECT_EQ(pair.source, made.source);
      EXPECT_EQ(pair.source_normals, made.source_normals);
      EXPECT_EQ(pair.target, made.target);
      EXPECT_EQ(pair.truth, made.truth);
      EXPECT_EQ(pair.interior, made.interior);
      EXPECT_EQ(pair.interior_truth, made.interior_truth);
      EXPECT_EQ(pair.surface, made.surface.leftCols(kSurface));
      EXPECT_EQ(pair.best_rigid.matrix(), made.best_rigid.matrix());
      EXPECT_EQ(pair.viewpoint, made.viewpoint);
    }
  }
}

TEST_F(PairSets, SayOfEachCaseWhatItWasMadeFrom) {
  const PairSet read = readPairSet(path());
  EXPECT_EQ(read.cases[1].organ, "liver");
  EXPECT_EQ(read.cases[1].subject, "Ünit \"1\"");
  EXPECT_EQ(read.cases[1].variation, 1);
  EXPECT_EQ(read.cases[1].deformation, 3);
  EXPECT_EQ(read.cases[1].seed, 0xFFFFFFFFFFFFFFF1ULL);
}

TEST_F(PairSets, MayHoldNoSamplesOfTheSurface) {
  const std::string bare = (folder() / "bare.safetensors").string();
  PairSet without = set();
  for (PairSetCase& one : without.cases) one.seen.points.surface.resize(3, 0);
  writePairSet(without, bare);
  const PairSet read = readPairSet(bare);
  EXPECT_EQ(read.pair(read.cases[0], Protocol::kCaseB).surface.cols(), 0);
  EXPECT_EQ(read.cases[0].seen.points.truth, without.cases[0].seen.points.truth);
}

TEST_F(PairSets, LackAProtocolOnlyWithAnError) {
  EXPECT_THROW(set().pair(set().cases[0], Protocol::kPermuted), std::invalid_argument);
}

TEST_F(PairSets, AreRefusedWithASentenceWhereTheyAreDamaged) {
  const std::string bytes = contents(path());
  expectRefusal("", "is empty");
  expectRefusal(bytes.substr(0, bytes.size() - 1), "is truncated");
  expectRefusal(replaced("unirit-pairs", "other-format"), "is no pair set");
  expectRefusal(replaced("\"version\":\"1\"", "\"version\":\"2\""), "is of version 2, not 1");
  expectRefusal(replaced("paired\\\"", "pairee\\\""), "unknown protocol 'pairee'");
  expectRefusal(replaced("\\\"seed\\\"", "\\\"sead\\\""), "metadata that is damaged");
  expectRefusal(replaced("\"caseb/pose\"", "\"caseb/pole\""), "lacks the tensor caseb/pose");
  expectRefusal(replaced("\"shape\":[2,128,3]", "\"shape\":[2,3,128]"), "misshapen tensor");
  EXPECT_THROW(readPairSet((folder() / "none").string()), std::runtime_error);
}

TEST_F(PairSets, OfUnequalCasesAreNotWritten) {
  const std::string other = (folder() / "other").string();
  PairSet unequal = set();
  unequal.cases[1].seen.points.truth.conservativeResize(Eigen::NoChange, kPoints - 1);
  EXPECT_THROW(writePairSet(unequal, other), std::invalid_argument);
  unequal = set();
  unequal.cases[0].seen.sights.pop_back();
  EXPECT_THROW(writePairSet(unequal, other), std::invalid_argument);
  EXPECT_THROW(writePairSet({kProtocols, {}}, other), std::invalid_argument);
  EXPECT_FALSE(fs::exists(other));
  EXPECT_THROW(writePairSet(set(), (folder() / "no/such").string()), std::runtime_error);
}

TEST_F(PairSets, AreReadByTheLinesOfPythonInTheDocumentation) {
  if (std::system("python3 -c 'import numpy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "python3 has no numpy here, so the documented lines cannot run";
  }
  const std::string page = contents(UNIRIT_DOCS "/pairs.md");
  const std::size_t begin = page.find("```python\n");
  ASSERT_NE(begin, std::string::npos);
  const std::size_t first = begin + 10;
  std::string lines = page.substr(first, page.find("```", first) - first);
  EXPECT_LE(std::count(lines.begin(), lines.end(), '\n'), 5);
  lines +=
      "for v in [*truth[1, 127], *tensor('caseb/target')[1, 5]]: print(repr(float(v)))\n"
      "print(cases[1]['seed'])\n";
  std::ofstream(folder() / "read.py") << lines;
  const std::string command = "cd " + folder().string() + " && python3 read.py >out 2>&1";
  const int status = std::system(command.c_str());
  std::istringstream out(contents(folder() / "out"));
  ASSERT_EQ(status, 0) << out.str();
  const RegistrationPair pair = set().pair(set().cases[1], Protocol::kCaseB);
  for (const auto& [points, index] : {std::pair(&pair.truth, 127), std::pair(&pair.target, 5)}) {
    for (int axis = 0; axis < 3; ++axis) {
      double value = 0.0;
      out >> value;
      EXPECT_NEAR(value, (*points)(axis, index), 1e-7) << out.str();
    }
  }
  std::uint64_t seed = 0;
  out >> seed;
  EXPECT_EQ(seed, set().cases[1].seed);
}

}  // namespace
}  // namespace unirit
