// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/metrics.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "neighbours.hpp"

namespace unirit {
namespace {

constexpr std::size_t kJacobianNeighbours = 9;  // the point itself and its 8 nearest

template <class Row>
std::vector<float> toVector(const Row& row) {
  return {row.data(), row.data() + row.size()};
}

double rootMeanSquare(const Eigen::RowVectorXf& lengths) {
  return std::sqrt(lengths.cast<double>().squaredNorm() / static_cast<double>(lengths.size()));
}

/// Determinant of the linear map that best takes the offsets of the neighbours before to those
/// after; the ridge stands for "no change", which is what the offsets cannot tell about the
/// direction across a flat patch.
float localDeterminant(const Eigen::Matrix3Xf& before, const Eigen::Matrix3Xf& change) {
  const Eigen::Matrix3f scatter = before * before.transpose();
  const Eigen::Matrix3f ridge = 1e-3F * scatter.trace() * Eigen::Matrix3f::Identity();
  const Eigen::Matrix3f gradient = change * before.transpose() * (scatter + ridge).inverse();
  return (Eigen::Matrix3f::Identity() + gradient).determinant();
}

double foldedFraction(const Points& rigid, const Points& displacements) {
  const Neighbours neighbours(rigid);
  Eigen::Index folded = 0;
  for (Eigen::Index i = 0; i < rigid.cols(); ++i) {
    const auto nearest = neighbours.find<kJacobianNeighbours>(rigid.col(i));
    Eigen::Matrix3Xf before(3, nearest.count), change(3, nearest.count);
    for (std::size_t k = 0; k < nearest.count; ++k) {
      const auto j = static_cast<Eigen::Index>(nearest.indices[k]);
      before.col(static_cast<Eigen::Index>(k)) = rigid.col(j) - rigid.col(i);
      change.col(static_cast<Eigen::Index>(k)) = displacements.col(j) - displacements.col(i);
    }
    if (before.squaredNorm() > 0.0F && localDeterminant(before, change) <= 0.0F) ++folded;
  }
  return static_cast<double>(folded) / static_cast<double>(rigid.cols());
}

}  // namespace

double quantile(std::vector<float> values, double share) {
  if (values.empty()) throw std::invalid_argument("values: an empty list has no quantile");
  const auto rank =
      static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

double rootMeanSquareDistance(const Points& a, const Points& b) {
  if (a.cols() != b.cols() || a.cols() == 0) {
    throw std::invalid_argument("a, b: must hold the same number of points, at least one");
  }
  return std::sqrt((a - b).cast<double>().squaredNorm() / static_cast<double>(a.cols()));
}

Eigen::RowVectorXf nearestDistances(const Points& from, const Points& to) {
  if (to.cols() == 0) throw std::invalid_argument("to: an empty cloud has no nearest point");
  const Neighbours neighbours(to);
  Eigen::RowVectorXf distances(from.cols());
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    distances[i] = std::sqrt(neighbours.find<1>(from.col(i)).squared_distances[0]);
  }
  return distances;
}

SurfaceResidual surfaceResidual(const Points& moved_surface, const Points& cloud,
                                double inlier_tolerance) {
  const Eigen::RowVectorXf distances = nearestDistances(cloud, moved_surface);
  const Eigen::RowVectorXf seen = nearestDistances(moved_surface, cloud);
  const auto tolerance = static_cast<float>(inlier_tolerance);
  SurfaceResidual residual;
  residual.rms = rootMeanSquare(distances);
  residual.median = quantile(toVector(distances), 0.5);
  residual.p95 = quantile(toVector(distances), 0.95);
  residual.inlier_fraction = (distances.array() <= tolerance).cast<double>().mean();
  residual.coverage = (seen.array() <= tolerance).cast<double>().mean();
  return residual;
}

DisplacementStatistics displacementStatistics(const Points& rigid, const Points& displacements) {
  if (rigid.cols() != displacements.cols() || rigid.cols() == 0) {
    throw std::invalid_argument("displacements: must be as many as the points, at least one");
  }
  const Eigen::RowVectorXf lengths = displacements.colwise().norm();
  DisplacementStatistics statistics;
  statistics.rms = rootMeanSquare(lengths);
  statistics.p95 = quantile(toVector(lengths), 0.95);
  statistics.max = lengths.maxCoeff();
  statistics.folded_fraction = foldedFraction(rigid, displacements);
  return statistics;
}

}  // namespace unirit
