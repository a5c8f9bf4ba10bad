// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/surface_io.hpp"

#include <gtest/gtest.h>
#include <pcl/PolygonMesh.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include "surface_files.hpp"

namespace unirit::test {
namespace {

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

TEST_F(SurfaceIo, TakesAViewpointAtTheOriginForNone) {
  std::string pcd = textPcd();
  const std::string viewpoint = "0.5 -2 3 1";
  pcd.replace(pcd.find(viewpoint), viewpoint.size(), "0 0 0 1");
  EXPECT_FALSE(read("cloud.pcd", pcd).viewpoint);
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

}  // namespace
}  // namespace unirit::test
