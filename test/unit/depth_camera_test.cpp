// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/depth_camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "shapes.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

// A box about `centre`, by half of its sides.
Surface box(const Eigen::Vector3f& half, const Eigen::Vector3f& centre = Eigen::Vector3f::Zero()) {
  Surface surface = test::box(2.0F * half);
  surface.vertices.points.colwise() += centre - half;
  return surface;
}

Surface joined(const Surface& a, const Surface& b) {
  Surface both;
  both.vertices.points.resize(3, a.vertices.size() + b.vertices.size());
  both.vertices.points << a.vertices.points, b.vertices.points;
  both.faces.resize(3, a.faces.cols() + b.faces.cols());
  both.faces << a.faces, (b.faces.array() + static_cast<int>(a.vertices.size())).matrix();
  return both;
}

DepthCamera noiseless() {
  DepthCamera camera;
  camera.depth_noise = 0.0;
  return camera;
}

// The mesh at 0.5 m on the optical axis.
Eigen::Isometry3d ahead(double distance = 0.5) {
  return Eigen::Isometry3d(Eigen::Translation3d(0, 0, distance));
}

// Point of the mesh nearest to `point`, by brute force over densely placed barycentric points.
struct Contact {
  double distance = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal;
};

Contact contact(const Surface& mesh, const Eigen::Isometry3d& pose, const Eigen::Vector3d& point) {
  Contact nearest;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    Eigen::Matrix3d t;
    for (int k = 0; k < 3; ++k) {
      t.col(k) = pose * mesh.vertices.points.col(mesh.faces(k, f)).cast<double>();
    }
    const Eigen::Vector3d normal = (t.col(1) - t.col(0)).cross(t.col(2) - t.col(0)).normalized();
    const double height = normal.dot(point - t.col(0));
    const Eigen::Vector3d shares = t.inverse() * (point - height * normal);
    if (shares.minCoeff() > -1e-3 && std::abs(height) < nearest.distance) {
      nearest = {std::abs(height), normal};
    }
  }
  return nearest;
}

TEST(DepthCamera, SeesOnlyTheSideThatFacesIt) {
  const Surface kidney = makePhantom("kidney", 2, 600);
  const Eigen::Isometry3d pose = lookAt({0.3, -0.1, 0.1}, {0, 0, 0}, {0, 0, 1}).inverse();
  DepthCamera camera = noiseless();
  camera.width = 96;
  camera.height = 72;
  const PointCloud cloud = renderDepth(kidney, pose, camera, 0);
  ASSERT_GT(cloud.size(), 200);
  EXPECT_EQ(cloud.normals.cols(), 0);
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d point = cloud.points.col(i).cast<double>();
    const Contact met = contact(kidney, pose, point);
    EXPECT_LT(met.distance, 1e-6);
    EXPECT_LT(met.normal.dot(point), 0.0);
  }
}

TEST(DepthCamera, NearObjectsHideWhatIsBehindThem) {
  const Surface wall = box({0.2F, 0.2F, 0.01F});
  const Surface both = joined(wall, box({0.05F, 0.05F, 0.01F}, {0, 0, -0.2F}));
  const PointCloud alone = renderDepth(wall, ahead(), noiseless(), 0);
  const PointCloud cloud = renderDepth(both, ahead(), noiseless(), 0);
  EXPECT_EQ(cloud.size(), alone.size());
  int hidden = 0;
  for (Eigen::Index i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f point = cloud.points.col(i);
    const bool before_object = std::abs(point[0] / point[2]) < 0.05F / 0.29F - 1e-3F &&
                               std::abs(point[1] / point[2]) < 0.05F / 0.29F - 1e-3F;
    if (!before_object) continue;
    EXPECT_NEAR(point[2], 0.29F, 1e-5F);
    ++hidden;
  }
  EXPECT_GT(hidden, 5000);
}

TEST(DepthCamera, SeesNothingOutsideItsFieldOfView) {
  const Surface wall = box({5.0F, 5.0F, 0.01F});
  const PointCloud cloud = renderDepth(wall, ahead(), noiseless(), 0);
  EXPECT_EQ(cloud.size(), 320 * 240);
  const Eigen::RowVectorXf x = cloud.points.row(0).cwiseQuotient(cloud.points.row(2));
  const double edge = std::tan(M_PI / 6.0);
  EXPECT_LT(x.cwiseAbs().maxCoeff(), edge);
  EXPECT_GT(x.cwiseAbs().maxCoeff(), 0.99 * edge);
  EXPECT_EQ(renderDepth(wall, ahead(-0.5), noiseless(), 0).size(), 0);
}

TEST(DepthCamera, SeesFacesThatReachBehindIt) {
  const PointCloud inside = renderDepth(box({1, 1, 1}), ahead(0), noiseless(), 0);
  ASSERT_EQ(inside.size(), 320 * 240);
  EXPECT_LT((inside.points.colwise().lpNorm<Eigen::Infinity>().array() - 1.0F).abs().maxCoeff(),
            1e-5F);
}

TEST(DepthCamera, MeasuresOnlyWithinItsRange) {
  const Surface both = joined(box({0.05F, 0.05F, 0.01F}, {0, 0, -0.4F}), box({0.3F, 0.3F, 0.01F}));
  DepthCamera camera = noiseless();
  camera.min_range = 0.2;
  const PointCloud far = renderDepth(both, ahead(), camera, 0);
  EXPECT_GT(far.points.row(2).minCoeff(), 0.4F);
  EXPECT_LT(far.size(), renderDepth(box({0.3F, 0.3F, 0.01F}), ahead(), camera, 0).size() / 2)
      << "what is too near still hides what is behind";
  camera.max_range = 0.4;
  EXPECT_EQ(renderDepth(both, ahead(), camera, 0).size(), 0);
}

TEST(DepthCamera, PointsGrowWithTheResolution) {
  const Surface liver = makePhantom("liver", 0, 2000);
  DepthCamera camera = noiseless();
  const auto coarse = static_cast<double>(renderDepth(liver, ahead(), camera, 0).size());
  camera.width *= 2;
  camera.height *= 2;
  EXPECT_NEAR(renderDepth(liver, ahead(), camera, 0).size() / coarse, 4.0, 0.05);
}

TEST(DepthCamera, NoiseAndOutliersAreAsSet) {
  const Surface wall = box({5.0F, 5.0F, 0.1F});
  DepthCamera camera;
  camera.depth_noise = 0.002;
  const PointCloud exact = renderDepth(wall, ahead(), noiseless(), 0);
  const PointCloud noisy = renderDepth(wall, ahead(), camera, 0);
  ASSERT_EQ(noisy.size(), exact.size());
  const Eigen::RowVectorXf along = noisy.points.colwise().norm() - exact.points.colwise().norm();
  EXPECT_NEAR(along.mean(), 0.0, 3e-5);
  EXPECT_NEAR(std::sqrt(along.squaredNorm() / along.size()), 0.002, 4e-5);
  EXPECT_LT((noisy.points.colwise().normalized() - exact.points.colwise().normalized())
                .cwiseAbs()
                .maxCoeff(),
            1e-5F);

  const Surface kidney = makePhantom("kidney", 0, 2000);
  camera = noiseless();
  const Points clean = renderDepth(kidney, ahead(), camera, 0).points;
  camera.outlier_fraction = 0.1;
  const Points dirty = renderDepth(kidney, ahead(), camera, 0).points;
  ASSERT_EQ(dirty.cols(), clean.cols());
  const auto moved = ((dirty - clean).colwise().norm().array() > 1e-6F).count();
  EXPECT_NEAR(static_cast<double>(moved) / static_cast<double>(clean.cols()), 0.1, 0.02);
  EXPECT_LT(dirty.row(2).maxCoeff(), 0.6F);
}

TEST(DepthCamera, IsDeterministicForASeed) {
  const Surface kidney = makePhantom("kidney", 0, 600);
  const Points first = renderDepth(kidney, ahead(), {}, 5).points;
  EXPECT_EQ(first, renderDepth(kidney, ahead(), {}, 5).points);
  EXPECT_NE(first, renderDepth(kidney, ahead(), {}, 6).points);
}

TEST(DepthCamera, LooksAtTheCentreWithItsImageUpright) {
  const Eigen::Isometry3d pose = lookAt({1, 2, 3}, {0, 0, 0.5}, {0, 0, 1});
  EXPECT_NEAR(pose.linear().determinant(), 1.0, 1e-12);
  const Eigen::Vector3d centre = pose.inverse() * Eigen::Vector3d(0, 0, 0.5);
  EXPECT_LT(centre.head<2>().norm(), 1e-12);
  EXPECT_GT(centre[2], 0.0);
  EXPECT_NEAR(pose.linear()(2, 0), 0.0, 1e-12);
  EXPECT_LT(pose.linear()(2, 1), 0.0) << "the image's y axis points down";
  EXPECT_THROW(lookAt({0, 0, 1}, {0, 0, 0}, {0, 0, 1}), std::invalid_argument);
  EXPECT_THROW(lookAt({0, 0, 1}, {0, 0, 1}, {0, 1, 0}), std::invalid_argument);
}

TEST(DepthCamera, RefusesWhatItCannotRender) {
  const Surface good = box({1, 1, 1});
  const auto refuses = [&](auto&& spoil) {
    Surface mesh = good;
    DepthCamera camera;
    spoil(mesh, camera);
    EXPECT_THROW(renderDepth(mesh, ahead(), camera, 0), std::invalid_argument);
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  refuses([](Surface& mesh, DepthCamera&) { mesh.faces.resize(3, 0); });
  refuses([](Surface& mesh, DepthCamera&) { mesh.faces(0, 0) = 8; });
  refuses([](Surface& mesh, DepthCamera&) { mesh.faces(0, 0) = -1; });
  refuses([](Surface& mesh, DepthCamera&) { mesh.vertices.points(0, 0) = std::nanf(""); });
  refuses([](Surface&, DepthCamera& camera) { camera.width = 0; });
  refuses([](Surface&, DepthCamera& camera) { camera.height = -3; });
  refuses([](Surface&, DepthCamera& camera) { camera.horizontal_field = 180.0; });
  refuses([](Surface&, DepthCamera& camera) { camera.min_range = 3.0; });
  refuses([](Surface&, DepthCamera& camera) { camera.depth_noise = -0.1; });
  refuses([](Surface&, DepthCamera& camera) { camera.depth_noise = kNan; });
  refuses([](Surface&, DepthCamera& camera) { camera.outlier_fraction = 1.1; });
  EXPECT_THROW(renderDepth(good, Eigen::Isometry3d(Eigen::Translation3d(kNan, 0, 0)), {}, 0),
               std::invalid_argument);
}

}  // namespace
}  // namespace unirit
