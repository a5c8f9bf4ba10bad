// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/point_cloud.hpp"

#include <stdexcept>

namespace unirit {

Eigen::Vector3f centroid(const Points& points) {
  if (points.cols() == 0) throw std::invalid_argument("points: an empty cloud has no centroid");
  return points.cast<double>().rowwise().mean().cast<float>();
}

Points moved(const Eigen::Isometry3d& pose, const Points& points) {
  return (pose * points.cast<double>()).cast<float>();
}

double extent(const Points& points) {
  const Eigen::Vector3f centre = centroid(points);
  return 2.0 * (points.colwise() - centre).cwiseAbs().maxCoeff();
}

}  // namespace unirit
