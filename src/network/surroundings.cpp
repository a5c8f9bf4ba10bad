// SPDX-License-Identifier: BSD-3-Clause
#include "surroundings.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace unirit {
namespace {

constexpr int kScales = static_cast<int>(kFlowScales.size());
static_assert(kScales == kNeighbourhoods && kFlowScales[1] == kFlowScales[0] / 2 &&
              kFlowScales[2] == kFlowScales[1] / 2 && kFlowScales[3] == kFlowScales[2] / 2);

/// Of a Gaussian of this standard deviation.
constexpr float exponentOf(float scale) { return -0.5F / (scale * scale); }

// Rows of the values that are averaged
constexpr Eigen::Index kToTarget = 0;  // vector to the nearest of the target
constexpr Eigen::Index kFromBack = 3;  // sum of the vectors to the target's points nearest to it
constexpr Eigen::Index kBackCount = 6;
constexpr Eigen::Index kOne = 7;
constexpr Eigen::Index kDeformation = 8;
constexpr Eigen::Index kToPlane = 11;  // the part of the first along the normal there
constexpr Eigen::Index kPlane = 14;    // that normal times its transpose
constexpr Eigen::Index kWay = 20;      // what is added to the coherent way, summed
static_assert(kWay + 3 == kAveraged);
constexpr int kWayScale = 1;
static_assert(kFlowScales[kWayScale] == kFlowLength);

/// Of a symmetric matrix.
using Triangle = Eigen::Matrix<float, 6, 1>;

Triangle triangleOf(const Eigen::Vector3f& p) {  // of p times its transpose
  return {p.x() * p.x(), p.y() * p.x(), p.z() * p.x(), p.y() * p.y(), p.z() * p.y(), p.z() * p.z()};
}

Eigen::Matrix3f matrixOf(const Triangle& t) {
  return (Eigen::Matrix3f() << t[0], t[1], t[2], t[1], t[3], t[4], t[2], t[4], t[5]).finished();
}

/// Of points with this mean and mean of p p^T.
Eigen::Vector3f directionOfLeastVariance(const Eigen::Vector3f& mean, const Triangle& squares) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(matrixOf(squares) - mean * mean.transpose());
  return solver.eigenvectors().col(0);
}

}  // namespace

void Surroundings::setTarget(const Points& target) {
  target_ = target;
  target_values_.setZero(kAveraged, target.cols());
  for (Eigen::Index j = 0; j < target.cols(); ++j) {
    target_values_.col(j).head<10>() << target.col(j), 1.0F, triangleOf(target.col(j));
  }
  target_normals_.resize(3, target.cols());
  workspace_.forEachBlock(target.cols(), [&](Scratch&, long begin, long count) {
    float sums[kBlockRows * kNeighbourhoods * kAveraged];
    workspace_.kernels().neighbourhoodSums(target.data() + 3 * begin, count, target.data(),
                                           target_values_.data(), target.cols(),
                                           exponentOf(kFlowScales.back()), sums);
    for (long j = 0; j < count; ++j) {
      const Eigen::Map<const Eigen::Matrix<float, 10, 1>> sum(sums + kNeighbourhoods * kAveraged *
                                                                         j);  // of the first size
      target_normals_.col(begin + j) =
          directionOfLeastVariance(sum.head<3>() / sum[3], sum.tail<6>() / sum[3]);
    }
  });
}

void Surroundings::setSource(const Points& source, const Points& deformation) {
  source_ = source;
  deformation_ = deformation;
  const auto find = [&](const Points& from, const Points& to, std::vector<int>& nearest) {
    nearest.resize(static_cast<std::size_t>(from.cols()));
    workspace_.forEachBlock(from.cols(), [&](Scratch&, long begin, long count) {
      workspace_.kernels().nearest(from.data() + 3 * begin, count, to.data(), to.cols(),
                                   nearest.data() + begin);
    });
  };
  find(source_, target_, nearest_target_);
  find(target_, source_, nearest_source_);

  values_.setZero(kAveraged, source.cols());
  for (Eigen::Index i = 0; i < source.cols(); ++i) {
    const int nearest = nearest_target_[static_cast<std::size_t>(i)];
    const Eigen::Vector3f to_target = target_.col(nearest) - source.col(i);
    const Eigen::Vector3f normal = target_normals_.col(nearest);
    auto values = values_.col(i);
    values.segment<3>(kToTarget) = to_target;
    values[kOne] = 1.0F;
    values.segment<3>(kDeformation) = deformation.col(i);
    values.segment<3>(kToPlane) = normal.dot(to_target) * normal;
    values.segment<6>(kPlane) = triangleOf(normal);
  }
  of_target_.resize(kFlowTargetInputs, target_.cols());
  for (Eigen::Index j = 0; j < target_.cols(); ++j) {
    const int nearest = nearest_source_[static_cast<std::size_t>(j)];
    const Eigen::Vector3f back = source.col(nearest) - target_.col(j);
    of_target_.col(j) << target_.col(j), back;
    values_.col(nearest).segment<3>(kFromBack) -= back;
    values_(kBackCount, nearest) += 1.0F;
  }
  fitCoherentWay();
}

void Surroundings::fitCoherentWay() {
  const Eigen::Index all = target_.cols(), count = std::min<Eigen::Index>(all, kFlowPlanes);
  plane_points_.resize(3, count);
  plane_offsets_.resize(3, count);
  plane_normals_.resize(3, count);
  const auto chosen = [&](Eigen::Index k) { return k * all / count; };
  const auto nearest = [&](Eigen::Index k) {
    return nearest_source_[static_cast<std::size_t>(chosen(k))];
  };
  for (Eigen::Index k = 0; k < count; ++k) {
    plane_points_.col(k) = source_.col(nearest(k));
    plane_offsets_.col(k) = target_.col(chosen(k)) - plane_points_.col(k);
    plane_normals_.col(k) = target_normals_.col(chosen(k));
  }
  way_.fit(plane_points_, plane_offsets_, plane_normals_);
  for (Eigen::Index k = 0; k < count; ++k) {
    values_.col(nearest(k)).segment<3>(kWay) += way_.sources().col(k);
  }
}

RowsView Surroundings::ofTarget() const {
  return {of_target_.data(), kFlowTargetInputs, of_target_.cols()};
}

RowsView Surroundings::ofSource(std::vector<float>& rows) const {
  rows.resize(static_cast<std::size_t>(kFlowInputs * source_.cols()));
  workspace_.forEachBlock(source_.cols(), [&](Scratch&, long begin, long count) {
    read(source_, deformation_, begin, count, nearest_target_.data() + begin, rows.data());
  });
  return {rows.data(), kFlowInputs, source_.cols()};
}

RowsView Surroundings::of(const Points& queries, const Points& deformation,
                          std::vector<float>& rows) const {
  rows.resize(static_cast<std::size_t>(kFlowInputs * queries.cols()));
  workspace_.forEachBlock(queries.cols(), [&](Scratch& scratch, long begin, long count) {
    workspace_.kernels().nearest(queries.data() + 3 * begin, count, target_.data(), target_.cols(),
                                 scratch.nearest.data());
    read(queries, deformation, begin, count, scratch.nearest.data(), rows.data());
  });
  return {rows.data(), kFlowInputs, queries.cols()};
}

/// Of a block of queries, whose nearest points of the target are known.
void Surroundings::read(const Points& queries, const Points& deformation, long begin, long count,
                        const int* nearest, float* rows) const {
  float sums[kBlockRows * kNeighbourhoods * kAveraged];
  workspace_.kernels().neighbourhoodSums(queries.data() + 3 * begin, count, source_.data(),
                                         values_.data(), source_.cols(), exponentOf(kFlowScales[0]),
                                         sums);
  const float ratio = static_cast<float>(source_.cols()) / static_cast<float>(target_.cols());
  for (long q = 0; q < count; ++q) {
    Eigen::Map<Eigen::Matrix<float, kFlowInputs, 1>> row(rows + kFlowInputs * (begin + q));
    const auto query = queries.col(begin + q);
    row.head<3>() = query;
    auto shares = row.segment<kScales>(3);
    Eigen::Map<Eigen::Matrix<float, 3, kFlowVectors>> vectors(row.data() + kFlowFirstVector);
    vectors.col(0) = target_.col(nearest[q]) - query;
    vectors.col(1) = deformation.col(begin + q);
    for (int scale = 0; scale < kScales; ++scale) {
      const Eigen::Map<const Eigen::Matrix<float, kAveraged, 1>> sum(
          sums + kAveraged * (kNeighbourhoods * q + scale));
      const float weight = std::max(sum[kOne], std::numeric_limits<float>::min());
      shares[scale] = ratio * sum[kBackCount] / weight;
      if (scale == kWayScale) vectors.col(2) = way_.rigid(query) + sum.segment<3>(kWay);
      auto means = vectors.middleCols<4>(3 + 4 * scale);
      means.col(0) = sum.segment<3>(kToTarget) / weight;
      means.col(1) = sum.segment<3>(kFromBack) / (sum[kBackCount] + kFlowFewest);
      means.col(2) = sum.segment<3>(kDeformation) / weight;
      const Eigen::Matrix3f planes =
          matrixOf(sum.segment<6>(kPlane) / weight) + kFlowPlaneRidge * Eigen::Matrix3f::Identity();
      means.col(3) = planes.inverse() * sum.segment<3>(kToPlane) / weight;
    }
    row.tail<kFlowVectors>() = vectors.colwise().norm();
  }
}

}  // namespace unirit
