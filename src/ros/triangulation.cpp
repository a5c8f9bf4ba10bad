// SPDX-License-Identifier: BSD-3-Clause
#include "triangulation.hpp"

#include <pcl/search/kdtree.h>
#include <pcl/surface/gp3.h>

#include <cmath>

#include "unirit/metrics.hpp"
#include "unirit/normals.hpp"

namespace unirit {
namespace {

constexpr double kReach = 0.1;    // longest edge, over the extent
constexpr double kStretch = 3.0;  // longest edge at a point, over the distance to its nearest
constexpr int kNeighbours = 60;

}  // namespace

Eigen::Matrix3Xi triangulate(const Points& points) {
  const Points normals = outwardNormals(points);
  const pcl::PointCloud<pcl::PointNormal>::Ptr cloud(new pcl::PointCloud<pcl::PointNormal>);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    pcl::PointNormal point;
    point.getVector3fMap() = points.col(i);
    point.getNormalVector3fMap() = normals.col(i);
    cloud->push_back(point);
  }
  pcl::GreedyProjectionTriangulation<pcl::PointNormal> greedy;
  greedy.setSearchRadius(kReach * extent(points));
  greedy.setMu(kStretch);
  greedy.setMaximumNearestNeighbors(kNeighbours);
  greedy.setMaximumSurfaceAngle(M_PI_2);
  greedy.setMinimumAngle(M_PI / 36.0);
  greedy.setMaximumAngle(M_PI * 2.0 / 3.0);
  greedy.setNormalConsistency(false);
  greedy.setInputCloud(cloud);
  greedy.setSearchMethod(
      pcl::search::KdTree<pcl::PointNormal>::Ptr(new pcl::search::KdTree<pcl::PointNormal>));
  std::vector<pcl::Vertices> triangles;
  greedy.reconstruct(triangles);

  Eigen::Matrix3Xi faces(3, static_cast<Eigen::Index>(triangles.size()));
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const auto& corners = triangles[static_cast<std::size_t>(f)].vertices;
    for (int k = 0; k < 3; ++k) {
      faces(k, f) = static_cast<int>(corners[static_cast<std::size_t>(k)]);
    }
  }
  return faces;
}

}  // namespace unirit
