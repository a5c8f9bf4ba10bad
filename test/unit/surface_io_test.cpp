// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/surface_io.hpp"

#include <gtest/gtest.h>
#include <pcl/PolygonMesh.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace unirit {
namespace {

namespace fs = std::filesystem;

const char* const kCorners = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
const char* const kFaces = "3 0 2 1\n3 0 1 3\n";

class SurfaceIo : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("unirit_surface_io_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }

  SurfaceFile read(const std::string& name, const std::string& bytes) const {
    return readSurface(write(name, bytes), 1.0);
  }

  // The sentence a file is refused with; empty where it is read.
  std::string refusal(const std::string& name, const std::string& bytes) const {
    try {
      read(name, bytes);
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      return error.what();
    }
    return {};
  }

  fs::path folder_;
};

std::string plyHeader(const std::string& format, const std::string& coordinate = "float",
                      const std::string& list = "list uchar int vertex_indices") {
  return "ply\nformat " + format + " 1.0\ncomment made by hand\nelement vertex 4\nproperty " +
         coordinate + " x\nproperty " + coordinate + " y\nproperty " + coordinate +
         " z\nelement face 2\nproperty " + list + "\nend_header\n";
}

std::string textPly() { return plyHeader("ascii") + kCorners + kFaces; }

template <class Number>
void append(std::string& bytes, Number number, bool swap) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  if (swap) std::reverse(raw, raw + sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

std::string binaryPly(bool big_endian) {
  std::string bytes = plyHeader(big_endian ? "binary_big_endian" : "binary_little_endian");
  const bool swap = big_endian == (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
  for (const float c : {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}) append<float>(bytes, c, swap);
  for (const auto& face : {std::array<int, 3>{0, 2, 1}, std::array<int, 3>{0, 1, 3}}) {
    bytes += '\3';
    for (const int corner : face) append(bytes, corner, swap);
  }
  return bytes;
}

std::string binaryStl(const std::string& header) {
  std::string bytes = header + std::string(80 - header.size(), ' ');
  append<std::uint32_t>(bytes, 2, false);
  for (const auto& facet : {std::array<float, 9>{0, 0, 0, 0, 1, 0, 1, 0, 0},
                            std::array<float, 9>{0, 0, 0, 1, 0, 0, 0, 0, 1}}) {
    for (int k = 0; k < 3; ++k) append(bytes, 0.0F, false);
    for (const float coordinate : facet) append(bytes, coordinate, false);
    append<std::uint16_t>(bytes, 0, false);
  }
  return bytes;
}

std::string textStl() {
  const std::string facet = " facet normal 0 0 1\n  outer loop\n";
  const std::string end = "  endloop\n endfacet\n";
  return "solid two facets\n" + facet + "vertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\n" + end + facet +
         "vertex -0 0 0\nvertex 1 0 0\nvertex 0 0 1\n" + end + "endsolid two facets\n";
}

std::string textObj() {
  return "# by hand\nmtllib a.mtl\nv 0 0 0 0.5 0.5 0.5\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n"
         "vn 0 0 1\nf 1/1/1 3//1 2/1\nf -4 -3 -1\n";
}

std::string textPcd() {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\n"
         "HEIGHT 1\nVIEWPOINT 0.5 -2 3 1 0 0 0\nPOINTS 4\nDATA ascii\n" +
         std::string(kCorners);
}

void expectCorners(const SurfaceFile& file) {
  Points corners(3, 4);
  corners << 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1;
  ASSERT_EQ(file.surface.vertices.size(), 4);
  EXPECT_EQ(file.surface.vertices.points, corners);
  EXPECT_EQ(file.surface.vertices.normals.cols(), 0);
  EXPECT_EQ(file.dropped, 0);
}

// The two faces, whatever the numbers of their vertices.
void expectTwoTriangles(const SurfaceFile& file) {
  ASSERT_EQ(file.surface.vertices.size(), 4);
  ASSERT_EQ(file.surface.faces.cols(), 2);
  Eigen::Matrix<float, 3, 6> corners;
  corners << 0, 0, 1, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1;
  for (int i = 0; i < 6; ++i) {
    EXPECT_EQ(file.surface.vertices.points.col(file.surface.faces(i % 3, i / 3)), corners.col(i));
  }
}

void expectTwoFaces(const SurfaceFile& file) {
  expectCorners(file);
  expectTwoTriangles(file);
}

TEST_F(SurfaceIo, ReadsPlyInEveryEncoding) {
  expectTwoFaces(read("text.ply", textPly()));
  expectTwoFaces(read("little.PLY", binaryPly(false)));
  expectTwoFaces(read("big.ply", binaryPly(true)));
}

TEST_F(SurfaceIo, ReadsPlyWithWindowsLineEnds) {
  std::string bytes;
  for (const char c : textPly()) bytes += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expectTwoFaces(read("windows.ply", bytes));
}

TEST_F(SurfaceIo, ReadsPlyOfEveryNumberType) {
  for (const char* type : {"double", "float32", "float64", "int", "short", "uint8", "char"}) {
    expectTwoFaces(read("typed.ply", plyHeader("ascii", type) + kCorners + kFaces));
  }
  for (const char* list : {"list int uint vertex_index", "list uint8 uint16 vertex_indices",
                           "list ushort short vertex_indices"}) {
    expectTwoFaces(read("listed.ply", plyHeader("ascii", "float", list) + kCorners + kFaces));
  }
}

TEST_F(SurfaceIo, SkipsFurtherPropertiesAndElementsOfPly) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement camera 1\nproperty float f\nelement vertex 4\n"
      "property uchar red\nproperty double z\nproperty list uchar float weights\n"
      "property float y\nproperty float x\nelement face 2\nproperty list uchar float texcoord\n"
      "property list uchar int vertex_indices\nproperty int label\nelement edge 0\n"
      "property int vertex1\nend_header\n";
  const std::string body =
      "7\n255 0 0 0 0\n255 0 2 9 9 0 1\n0 0 0 1 0\n0 1 1 9 0 0\n6 0 0 0 0 0 0 3 0 2 1 5\n"
      "0 3 0 1 3 5\n";
  expectTwoFaces(read("rich.ply", header + body));
}

TEST_F(SurfaceIo, ReadsFacesThatComeBeforeTheVertices) {
  expectTwoFaces(read("swapped.ply",
                      "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int "
                      "vertex_indices\nelement vertex 4\nproperty float x\nproperty float y\n"
                      "property float z\nend_header\n" +
                          std::string(kFaces) + kCorners));
}

TEST_F(SurfaceIo, SplitsPolygonsIntoFans) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty "
      "float y\nproperty float z\nelement face 1\nproperty list uchar int "
      "vertex_indices\nend_header\n";
  const auto file =
      read("pentagon.ply", header + "0 0 0\n1 0 0\n2 1 0\n1 2 0\n0 1 0\n5 0 1 2 3 4\n");
  Eigen::Matrix3Xi faces(3, 3);
  faces << 0, 0, 0, 1, 2, 3, 2, 3, 4;
  ASSERT_EQ(file.surface.faces.cols(), 3);
  EXPECT_EQ(file.surface.faces, faces);
}

TEST_F(SurfaceIo, ReadsStlAsAConnectedMesh) {
  expectTwoTriangles(read("text.stl", textStl()));
  expectTwoTriangles(read("binary.stl", binaryStl("made by hand")));
  expectTwoTriangles(read("solid.stl", binaryStl("solid although binary")));
}

TEST_F(SurfaceIo, ReadsObjWithTexturesColoursAndRelativeIndices) {
  expectTwoFaces(read("mesh.obj", textObj()));
}

TEST_F(SurfaceIo, ReadsPcdWithItsViewpoint) {
  const SurfaceFile file = read("cloud.pcd", textPcd());
  expectCorners(file);
  ASSERT_TRUE(file.viewpoint);
  EXPECT_EQ(*file.viewpoint, Eigen::Vector3f(0.5F, -2.0F, 3.0F));
}

TEST_F(SurfaceIo, ReadsWhatPclWrites) {
  pcl::PointCloud<pcl::PointNormal> cloud;
  for (int i = 0; i < 300; ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() << 0.1F * static_cast<float>(i), -2.0F, static_cast<float>(i % 7);
    point.getNormalVector3fMap() << 0, static_cast<float>(i % 2), static_cast<float>((i + 1) % 2);
    cloud.push_back(point);
  }
  pcl::io::savePCDFileASCII(path("text.pcd"), cloud);
  pcl::io::savePCDFileBinary(path("binary.pcd"), cloud);
  pcl::io::savePCDFileBinaryCompressed(path("compressed.pcd"), cloud);
  pcl::io::savePLYFileBinary(path("binary.ply"), cloud);
  for (const char* name : {"text.pcd", "binary.pcd", "compressed.pcd", "binary.ply"}) {
    SCOPED_TRACE(name);
    const PointCloud read = readSurface(path(name), 1.0).surface.vertices;
    ASSERT_EQ(read.size(), 300);
    ASSERT_EQ(read.normals.cols(), 300);
    for (int i = 0; i < 300; ++i) {
      EXPECT_LT((read.points.col(i) - cloud[i].getVector3fMap()).norm(), 1e-6F);
      EXPECT_EQ(read.normals.col(i), cloud[i].getNormalVector3fMap());
    }
  }
}

TEST_F(SurfaceIo, ConvertsTheFilesUnitToMetres) {
  const SurfaceFile file = readSurface(write("cloud.pcd", textPcd()), 0.001);
  EXPECT_FLOAT_EQ(file.surface.vertices.points(0, 1), 0.001F);
  EXPECT_FLOAT_EQ((*file.viewpoint)[2], 0.003F);
  EXPECT_THROW(readSurface(path("cloud.pcd"), 0.0), std::invalid_argument);
}

TEST_F(SurfaceIo, DropsInvalidPointsTogetherWithTheirFaces) {
  const SurfaceFile file =
      read("nan.ply", plyHeader("ascii") + "nan 0 0\n1 0 0\n0 1 0\n0 0 1\n3 1 2 3\n3 0 1 3\n");
  EXPECT_EQ(file.dropped, 1);
  EXPECT_EQ(file.surface.vertices.size(), 3);
  ASSERT_EQ(file.surface.faces.cols(), 1);
  EXPECT_EQ(file.surface.faces.col(0), Eigen::Vector3i(0, 1, 2));
  EXPECT_EQ(
      read("huge.ply", plyHeader("ascii", "double") + "1e300 0 0\n1 0 0\n0 1 0\n0 0 1\n" + kFaces)
          .dropped,
      1);
}

TEST_F(SurfaceIo, LeavesNormalsEmptyWhereOneIsInvalid) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty "
      "float y\nproperty float z\nproperty float nx\nproperty float ny\n"
      "property float nz\nend_header\n";
  EXPECT_EQ(read("good.ply", header + "0 0 0 0 0 2\n1 0 0 0 1 0\n").surface.vertices.normals.col(0),
            Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(read("zero.ply", header + "0 0 0 0 0 2\n1 0 0 0 0 0\n").surface.vertices.normals.cols(),
            0);
}

TEST_F(SurfaceIo, WritesWhatItReadsBack) {
  Surface surface;
  surface.vertices.points = Points::Random(3, 50);
  surface.vertices.normals = surface.vertices.points.colwise().normalized();
  surface.faces = Eigen::Matrix3Xi::Constant(3, 7, 49);
  writePly(surface, path("copy.ply"), 0.001);
  const SurfaceFile file = readSurface(path("copy.ply"), 0.001);
  EXPECT_LT((file.surface.vertices.points - surface.vertices.points).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_LT((file.surface.vertices.normals - surface.vertices.normals).cwiseAbs().maxCoeff(),
            1e-6F);
  EXPECT_EQ(file.surface.faces, surface.faces);
  pcl::PolygonMesh by_pcl;
  ASSERT_EQ(pcl::io::loadPLYFile(path("copy.ply"), by_pcl), 0);
  EXPECT_EQ(by_pcl.cloud.width * by_pcl.cloud.height, 50U);
  EXPECT_EQ(by_pcl.polygons.size(), 7U);
}

TEST_F(SurfaceIo, SaysWhereItCannotWrite) {
  EXPECT_THROW(writePly({}, path("no/such/folder/a.ply"), 1.0), std::runtime_error);
  EXPECT_THROW(writePly({}, folder_.string(), 1.0), std::runtime_error);
}

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
}  // namespace unirit
