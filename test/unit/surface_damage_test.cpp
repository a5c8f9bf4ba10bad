// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <iterator>
#include <utility>

#include "surface_files.hpp"

namespace unirit::test {
namespace {

TEST_F(SurfaceIo, NamesTheFault) {
  const auto says = [&](const std::string& sentence, const std::string& words) {
    return sentence.find(words) != std::string::npos ? ::testing::AssertionSuccess()
                                                     : ::testing::AssertionFailure() << sentence;
  };
  const auto ply = [](std::string bytes, const std::string& from, const std::string& to) {
    return bytes.replace(bytes.find(from), from.size(), to);
  };
  EXPECT_TRUE(says(refusal("a.txt", "1 2 3"), "extension"));
  EXPECT_TRUE(says(refusal("a.ply", ""), "does not begin with \"ply\""));
  EXPECT_TRUE(says(refusal("a.ply", ply(textPly(), "3 0 1 3", "3 0 1 4")), "does not exist"));
  EXPECT_TRUE(says(refusal("a.ply", ply(textPly(), "3 0 1 3", "3 0 1 -1")), "does not exist"));
  EXPECT_TRUE(says(refusal("a.ply", ply(textPly(), "vertex 4", "vertex 99999999999")), "promises"));
  EXPECT_TRUE(says(refusal("a.ply", ply(textPly(), "vertex 4", "vertex 5")), "at \"face\" 1 of 2"));
  EXPECT_TRUE(says(refusal("a.ply", ply(textPly(), "vertex 4", "vertex -4")), "negative"));
  EXPECT_TRUE(says(refusal("a.ply", ply(textPly(), "float x", "float w")), "lack x, y or z"));
  EXPECT_TRUE(says(refusal("a.ply", ply(textPly(), "1 0 0", "1 O 0")), "vertex\" 2 of 4"));
  EXPECT_TRUE(says(refusal("a.ply", ply(textPly(), "3 0 1 3", "2 0 1")), "2 corners"));
  EXPECT_TRUE(says(refusal("a.obj", "v 0 0 0\nf 1 2 3\n"), "does not exist"));
  EXPECT_TRUE(says(refusal("a.obj", "v 0 0\n"), "in line 1"));
  EXPECT_TRUE(says(refusal("a.obj", "# nothing\n"), "no finite point"));
  EXPECT_TRUE(says(refusal("a.stl", binaryStl("cut").substr(0, 180)), "shorter than"));
  EXPECT_TRUE(says(refusal("a.stl", textStl().substr(0, 100)), "endsolid"));
  EXPECT_TRUE(says(refusal("a.pcd", ply(textPcd(), "POINTS 4", "POINTS 5")), "do not fit"));
  EXPECT_TRUE(says(refusal("a.pcd", ply(textPcd(), "SIZE 4 4 4", "SIZE 4 4")), "do not fit"));
  EXPECT_TRUE(says(refusal("a.pcd", ply(textPcd(), "DATA ascii", "DATA morse")), "morse"));
  EXPECT_TRUE(says(refusal("a.pcd", ply(textPcd(), "0 1 0", "nan nan")), "point 4 of 4"));
  fs::create_directories(path("folder.ply"));
  EXPECT_THROW(readSurface(path("folder.ply"), 1.0), std::runtime_error);
  EXPECT_THROW(readSurface(path("missing.ply"), 1.0), std::runtime_error);
}

TEST_F(SurfaceIo, SurvivesFilesCutAtAnyByteAndBytesThatFlip) {
  pcl::PointCloud<pcl::PointXYZ> cloud(40, 1, {1.0F, 2.0F, 3.0F});
  pcl::io::savePCDFileBinaryCompressed(path("compressed.pcd"), cloud);
  std::ifstream file(path("compressed.pcd"), std::ios::binary);
  const std::string compressed{std::istreambuf_iterator<char>(file), {}};
  const std::pair<const char*, std::string> samples[] = {
      {"text.ply", textPly()}, {"little.ply", binaryPly(false)}, {"big.ply", binaryPly(true)},
      {"text.stl", textStl()}, {"binary.stl", binaryStl("x")},   {"mesh.obj", textObj()},
      {"text.pcd", textPcd()}, {"packed.pcd", compressed}};
  for (const auto& [name, bytes] : samples) {
    int refused = 0;
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      refused += refusal(name, bytes.substr(0, length)).empty() ? 0 : 1;
      constexpr char kValues[] = {'\0', '9', '\x7f', '\xff'};
      std::string flipped = bytes;
      flipped[length] = kValues[length % 4];
      refusal(name, flipped);
    }
    EXPECT_GT(refused, static_cast<int>(bytes.size() / 4)) << name;
  }
}

}  // namespace
}  // namespace unirit::test
