// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/icp.hpp"

#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>

#include "unirit/evaluation/baselines.hpp"
#include "unirit/evaluation/settings_text.hpp"
#include "unirit/registration.hpp"

namespace unirit {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

/// In units of the source's extent, about its centroid: PCL's thresholds are made for such lengths.
Cloud::Ptr toPcl(const Points& points, const Eigen::Vector3f& centre, float unit) {
  const Points scaled = (points.colwise() - centre) / unit;
  Cloud::Ptr cloud(new Cloud);
  cloud->reserve(static_cast<std::size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    cloud->push_back({scaled(0, i), scaled(1, i), scaled(2, i)});
  }
  return cloud;
}

template <class Algorithm>
MethodResult align(const RegistrationPair& pair, const IcpSettings& settings) {
  const Eigen::Vector3f centre = centroid(pair.source);
  const auto unit = static_cast<float>(extent(pair.source));
  Algorithm algorithm;
  algorithm.setInputSource(toPcl(pair.source, centre, unit));
  algorithm.setInputTarget(toPcl(pair.target, centre, unit));
  algorithm.setMaxCorrespondenceDistance(settings.max_distance);
  algorithm.setMaximumIterations(settings.iterations);
  algorithm.setTransformationEpsilon(1e-10);
  algorithm.setEuclideanFitnessEpsilon(1e-10);
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  if (settings.centroids) start = alignCentroids({pair.source, {}}, {pair.target, {}});
  Eigen::Matrix4f guess = Eigen::Matrix4f::Identity();
  guess.topRightCorner<3, 1>() = start.translation().cast<float>() / unit;
  Cloud moved;
  algorithm.align(moved, guess);

  const Eigen::Matrix4f found = algorithm.getFinalTransformation();
  if (!algorithm.hasConverged() || !found.allFinite()) {
    MethodResult result = movedRigidly(pair, start);
    result.refused = true;
    return result;
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(found.topLeftCorner<3, 3>().cast<double>())
                      .normalized()
                      .toRotationMatrix();
  const Eigen::Vector3d about = centre.cast<double>();
  pose.translation() =
      unit * found.topRightCorner<3, 1>().cast<double>() + about - pose.linear() * about;
  return movedRigidly(pair, pose);
}

}  // namespace

std::string Icp::parameters() const { return toText(settings_); }

MethodResult Icp::registerPair(const RegistrationPair& pair) {
  using Point = pcl::PointXYZ;
  return variant_ == Variant::kGeneralized
             ? align<pcl::GeneralizedIterativeClosestPoint<Point, Point>>(pair, settings_)
             : align<pcl::IterativeClosestPoint<Point, Point>>(pair, settings_);
}

}  // namespace unirit
