// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/point_drift_method.hpp"

#include <cmath>

#include "unirit/evaluation/settings_text.hpp"

namespace unirit {
namespace {

/// Both clouds in the unit of the drift, and the way back.
struct Frame {
  Eigen::Vector3d source_origin;
  Eigen::Vector3d target_origin;  // the source's own where it starts as it stands
  double unit = 1.0;              // [m]

  Frame(const RegistrationPair& pair, bool centroids, double coordinates)
      : source_origin(pair.source.cast<double>().rowwise().mean()),
        target_origin(centroids ? pair.target.cast<double>().rowwise().mean() : source_origin),
        unit(std::sqrt((pair.source.cast<double>().colwise() - source_origin).squaredNorm() /
                       (coordinates * static_cast<double>(pair.source.cols())))) {}

  Eigen::Matrix3Xd enter(const Points& points, const Eigen::Vector3d& origin) const {
    return (points.cast<double>().colwise() - origin) / unit;
  }
  Points leave(const Eigen::Matrix3Xd& points) const {
    return ((unit * points).colwise() + target_origin).cast<float>();
  }
  DriftClouds clouds(const RegistrationPair& pair) const {
    return {enter(pair.source, source_origin), enter(pair.target, target_origin),
            enter(pair.interior, source_origin)};
  }

  /// The pose without its scale, which is taken at the source's centroid.
  Eigen::Isometry3d leave(const Similarity& pose) const {
    Eigen::Isometry3d left = Eigen::Isometry3d::Identity();
    left.linear() = pose.rotation;
    left.translation() = unit * pose.translation + target_origin - pose.rotation * source_origin;
    return left;
  }
};

}  // namespace

std::string CoherentPointDrift::parameters() const { return toText(settings_); }

MethodResult CoherentPointDrift::registerPair(const RegistrationPair& pair) {
  const Frame frame(pair, settings_.centroids, 1.0);
  const DriftClouds clouds = frame.clouds(pair);
  const Drift drift =
      rigid_ ? driftRigidly(clouds, settings_.drift) : driftCoherently(clouds, settings_.drift);
  MethodResult result{false, frame.leave(drift.source), frame.leave(drift.interior), {}};
  if (rigid_) result.pose = frame.leave(drift.pose);
  return result;
}

std::string BayesianPointDrift::parameters() const { return toText(settings_); }

MethodResult BayesianPointDrift::registerPair(const RegistrationPair& pair) {
  const Frame frame(pair, settings_.centroids, 3.0);
  const Drift drift = driftBayesian(frame.clouds(pair), settings_.drift);
  return {false, frame.leave(drift.source), frame.leave(drift.interior), frame.leave(drift.pose)};
}

}  // namespace unirit
