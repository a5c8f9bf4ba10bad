// SPDX-License-Identifier: BSD-3-Clause
#include "sighting.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "neighbours.hpp"
#include "unirit/normals.hpp"

namespace unirit {
namespace {

constexpr Eigen::Index kDiscs = 256;  // enough for the median
// The mean normal of a surface seen from all sides is at most so long. The sides of thin lobes may
// be mistaken for each other, so the area counts too: of training organs, whole and deformed, it is
// 0.92 at least; of views of 40 %, outliers among them, 0.80 at most.
constexpr double kOpennessOverShare = 3.5;
constexpr double kLeastShare = 0.75;
constexpr double kWholeOpennessFromViewpoint = 0.25;  // a viewpoint speaks for one side
constexpr float kFar = 8.0F;  // a viewpoint that is not known lies so far away

/// Whether the outward normals look to the viewpoint on the whole; from a wrong one, such as that
/// of another frame, they mostly look away.
bool faces(const PointCloud& seen, const Eigen::Vector3f& viewpoint) {
  const Points rays = ((-seen.points).colwise() + viewpoint).colwise().normalized();
  return seen.normals.cwiseProduct(rays).sum() > 0.0F;
}

/// No choice of signs makes the normals more open: along any direction, a mean is at most the root
/// of the mean square.
double mostOpenness(const Points& normals) {
  const Eigen::Matrix3f moment = normals * normals.transpose() / static_cast<float>(normals.cols());
  return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(moment).eigenvalues()[2]);
}

/// What the discs cover that reach to each point's farthest neighbour.
double sampledArea(const Points& points, const Eigen::MatrixXi& nearest) {
  const Eigen::Index step = std::max<Eigen::Index>(1, points.cols() / kDiscs);
  std::vector<float> squared_radii;
  squared_radii.reserve(static_cast<std::size_t>(points.cols() / step + 1));
  for (Eigen::Index i = 0; i < points.cols(); i += step) {
    const Eigen::Index farthest = nearest(nearest.rows() - 1, i);
    squared_radii.push_back((points.col(farthest) - points.col(i)).squaredNorm());
  }
  const auto middle = squared_radii.begin() + static_cast<std::ptrdiff_t>(squared_radii.size() / 2);
  std::nth_element(squared_radii.begin(), middle, squared_radii.end());
  return M_PI * static_cast<double>(*middle) * static_cast<double>(points.cols()) /
         kSurfaceNeighbours;
}

}  // namespace

double sampledArea(const Points& points) { return sampledArea(points, nearestPoints(points)); }

Sighting sightingOf(const PointCloud& target, double organ_area) {
  const Eigen::MatrixXi nearest = nearestPoints(target.points);
  Sighting sighting;
  sighting.seen = {target.points, estimateNormals(target.points, nearest)};
  PointCloud& seen = sighting.seen;
  const double share = sampledArea(seen.points, nearest) / organ_area;
  const double most = kOpennessOverShare * (share - kLeastShare);
  sighting.whole = !target.viewpoint && mostOpenness(seen.normals) < most;
  if (sighting.whole) return sighting;

  orientOutwards(seen.points, nearest, seen.normals);
  const bool known = target.viewpoint && faces(seen, *target.viewpoint);
  sighting.whole =
      openness(seen.normals) < (known ? std::min(most, kWholeOpennessFromViewpoint) : most);
  if (sighting.whole) return sighting;
  return seenFrom(known ? *target.viewpoint
                        : Eigen::Vector3f(centroid(seen.points) +
                                          kFar * seen.normals.rowwise().mean().normalized()),
                  sighting);
}

Sighting seenFrom(const Eigen::Vector3f& eye, const Sighting& part) {
  Sighting sighting{part.seen, false, eye};
  orientTowards(sighting.seen.points, eye, sighting.seen.normals);
  return sighting;
}

Sighting moved(const Eigen::Isometry3f& transform, const Sighting& sighting) {
  Sighting moved{{transform * sighting.seen.points, transform.linear() * sighting.seen.normals},
                 sighting.whole,
                 sighting.eye};
  if (moved.eye) moved.eye = transform * *moved.eye;
  return moved;
}

}  // namespace unirit
