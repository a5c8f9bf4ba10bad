// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "shapes.hpp"
#include "unirit/normals.hpp"
#include "unirit/sampling.hpp"
#include "unirit/simulation/depth_camera.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

Surface insideOut(Surface mesh) {
  mesh.faces.row(0).swap(mesh.faces.row(2));
  return mesh;
}

/// Share of the vertices whose normal points away from the others.
double outwardShare(const Surface& mesh) {
  const Points offsets = mesh.vertices.points.colwise() - centroid(mesh.vertices.points);
  const Eigen::RowVectorXf cosines =
      vertexNormals(mesh).cwiseProduct(offsets.colwise().normalized()).colwise().sum();
  return static_cast<double>((cosines.array() > 0.0F).count()) /
         static_cast<double>(cosines.size());
}

TEST(VertexNormals, AreTheMeanOfTheFacesAroundByArea) {
  Surface roof;  // a face of area 2 looking along z and one of area 1 looking along x meet
  roof.vertices.points.resize(3, 4);
  roof.vertices.points << 0, -2, 0, 0,  //
      0, 0, 2, 0,                       //
      0, 0, 0, -1;
  roof.faces.resize(3, 2);
  roof.faces << 0, 0,  //
      2, 3,            //
      1, 2;
  const Points normals = vertexNormals(roof);
  EXPECT_TRUE(normals.col(0).isApprox(Eigen::Vector3f(1, 0, 2).normalized()));
  EXPECT_TRUE(normals.col(1).isApprox(Eigen::Vector3f(0, 0, 1)));
  EXPECT_TRUE(normals.col(3).isApprox(Eigen::Vector3f(1, 0, 0)));
}

TEST(VertexNormals, AreZeroWithoutAFaceWithAnArea) {
  Surface box = test::box({1.0F, 2.0F, 3.0F});
  box.vertices.points.conservativeResize(Eigen::NoChange, 9);
  box.vertices.points.col(8) << 0.5F, 0.5F, 0.5F;
  const Points normals = vertexNormals(box);
  EXPECT_TRUE(normals.leftCols(8).colwise().norm().isOnes(1e-6F));
  EXPECT_EQ(normals.col(8), Eigen::Vector3f::Zero());
}

TEST(TurnFacesOutwards, TurnsOrgansThatAreInsideOutAndNoOthers) {
  for (const char* organ : {"kidney", "liver"}) {
    const Surface mesh = makePhantom(organ, 3, 2000);
    EXPECT_GT(outwardShare(mesh), 0.85);  // organs are not convex
    Surface turned = mesh;
    turnFacesOutwards(turned);
    EXPECT_EQ(turned.faces, mesh.faces);
    turned = insideOut(mesh);
    EXPECT_LT(outwardShare(turned), 0.15);
    turnFacesOutwards(turned);
    EXPECT_LT((vertexNormals(turned) - vertexNormals(mesh)).cwiseAbs().maxCoeff(), 1e-5F);
  }
}

TEST(TurnFacesOutwards, JudgesFarFromTheOrigin) {
  Surface far = insideOut(test::box({0.1F, 0.2F, 0.3F}));
  far.vertices.points.colwise() += Eigen::Vector3f(3.0F, -2.0F, 5.0F);
  turnFacesOutwards(far);
  EXPECT_EQ(outwardShare(far), 1.0);
}

/// Mean cosine of the normals with the rays to the eye.
float agreement(const Points& points, const Points& normals, const Eigen::Vector3f& eye) {
  const Points rays = ((-points).colwise() + eye).colwise().normalized();
  return normals.cwiseProduct(rays).colwise().sum().mean();
}

TEST(OrientOutwards, TurnsViewsOfOrgansTowardsTheCameraThatSawThem) {
  for (const std::string& organ : phantomOrgans()) {
    const Surface mesh = makePhantom(organ, 1, 4000);
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      Random random(seed);
      const Eigen::Vector3d eye = 0.6 * random.direction();
      DepthCamera camera;
      camera.width = 160;
      camera.height = 120;
      const Eigen::Vector3d up = random.direction();
      const PointCloud seen = renderDepth(mesh, lookAt(eye, {0, 0, 0}, up).inverse(), camera, seed);
      const Points points = select(seen.points, sampleEvenly(seen.points, 1024));
      const Points normals = outwardNormals(points);
      EXPECT_GT(agreement(points, normals, Eigen::Vector3f::Zero()), 0.2F) << organ << ' ' << seed;
    }
  }
}

}  // namespace
}  // namespace unirit
