// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/metrics.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "neighbours.hpp"
#include "network/kernels.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

// Points of large clouds that a residual looks at, about
constexpr Eigen::Index kAsked = 10000;    // whose nearest is sought
constexpr Eigen::Index kSurface = 60000;  // of the moved surface: fewer would lie farther away
constexpr Eigen::Index kCloud = 20000;    // still many within any tolerance
constexpr Eigen::Index kFew = 1024;       // looked at one by one, which is faster than a k-d tree

template <class Row>
std::vector<float> toVector(const Row& row) {
  return {row.data(), row.data() + row.size()};
}

double rootMeanSquare(const Eigen::RowVectorXf& lengths) {
  return std::sqrt(lengths.cast<double>().squaredNorm() / static_cast<double>(lengths.size()));
}

Points drawn(const Points& points, Eigen::Index count) {
  return select(points, drawByLot(points, count));
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
  Eigen::RowVectorXf distances(from.cols());
  if (to.cols() <= kFew) {
    std::vector<int> nearest(static_cast<std::size_t>(from.cols()));
    selectKernels().nearest(from.data(), from.cols(), to.data(), to.cols(), nearest.data());
    for (Eigen::Index i = 0; i < from.cols(); ++i) {
      distances[i] = (to.col(nearest[static_cast<std::size_t>(i)]) - from.col(i)).norm();
    }
    return distances;
  }
  const Neighbours neighbours(to);
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    distances[i] = std::sqrt(neighbours.find<1>(from.col(i)).squared_distances[0]);
  }
  return distances;
}

SurfaceResidual surfaceResidual(const Points& moved_surface, const Points& cloud,
                                double inlier_tolerance) {
  const Eigen::RowVectorXf distances =
      nearestDistances(drawn(cloud, kAsked), drawn(moved_surface, kSurface));
  const Eigen::RowVectorXf seen =
      nearestDistances(drawn(moved_surface, kAsked), drawn(cloud, kCloud));
  const auto tolerance = static_cast<float>(inlier_tolerance);
  SurfaceResidual residual;
  residual.rms = rootMeanSquare(distances);
  residual.median = quantile(toVector(distances), 0.5);
  residual.p95 = quantile(toVector(distances), 0.95);
  residual.inlier_fraction = (distances.array() <= tolerance).cast<double>().mean();
  residual.coverage = (seen.array() <= tolerance).cast<double>().mean();
  return residual;
}

DisplacementStatistics displacementStatistics(const Points& displacements,
                                              const std::vector<Eigen::Matrix3f>& jacobians) {
  if (displacements.cols() == 0 || jacobians.empty()) {
    throw std::invalid_argument("displacements, jacobians: must hold at least one point");
  }
  const Eigen::RowVectorXf lengths = displacements.colwise().norm();
  DisplacementStatistics statistics;
  statistics.rms = rootMeanSquare(lengths);
  statistics.p95 = quantile(toVector(lengths), 0.95);
  statistics.max = lengths.maxCoeff();
  std::vector<float> stretches, compressions;
  stretches.reserve(jacobians.size());
  compressions.reserve(jacobians.size());
  std::size_t folded = 0;
  for (const Eigen::Matrix3f& jacobian : jacobians) {
    // Principal stretches are the roots of the eigenvalues of J^T J
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
    solver.computeDirect(jacobian.transpose() * jacobian, Eigen::EigenvaluesOnly);
    const Eigen::Vector3f stretch = solver.eigenvalues().cwiseMax(0.0F).cwiseSqrt();
    compressions.push_back(stretch[0]);
    stretches.push_back(stretch[2]);
    if (!(jacobian.determinant() > 0.0F)) ++folded;
  }
  statistics.stretch = quantile(std::move(stretches), 0.95);
  statistics.compression = quantile(std::move(compressions), 0.05);
  statistics.folded_fraction = static_cast<double>(folded) / static_cast<double>(jacobians.size());
  return statistics;
}

}  // namespace unirit
