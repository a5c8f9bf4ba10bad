// SPDX-License-Identifier: BSD-3-Clause
#include "surroundings.hpp"

#include <algorithm>
#include <limits>

namespace unirit {
namespace {

constexpr int kScales = static_cast<int>(kFlowScales.size());
static_assert(kScales == kNeighbourhoods && kFlowScales[1] == kFlowScales[0] / 2 &&
              kFlowScales[2] == kFlowScales[1] / 2 && kFlowScales[3] == kFlowScales[2] / 2);

// Rows of the values that are averaged
constexpr Eigen::Index kToTarget = 0;  // vector to the nearest of the target
constexpr Eigen::Index kFromBack = 3;  // sum of the vectors to the target's points nearest to it
constexpr Eigen::Index kBackCount = 6;
constexpr Eigen::Index kOne = 7;

}  // namespace

void Surroundings::setClouds(const Points& source, const Points& target) {
  source_ = source;
  target_ = target;
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
    values_.col(i).segment<3>(kToTarget) = target.col(nearest) - source.col(i);
    values_(kOne, i) = 1.0F;
  }
  of_target_.resize(kFlowTargetInputs, target.cols());
  for (Eigen::Index j = 0; j < target.cols(); ++j) {
    const int nearest = nearest_source_[static_cast<std::size_t>(j)];
    const Eigen::Vector3f back = source.col(nearest) - target.col(j);
    of_target_.col(j) << target.col(j), back;
    values_.col(nearest).segment<3>(kFromBack) -= back;
    values_(kBackCount, nearest) += 1.0F;
  }
}

RowsView Surroundings::ofTarget() const {
  return {of_target_.data(), kFlowTargetInputs, of_target_.cols()};
}

RowsView Surroundings::ofSource(std::vector<float>& rows) const {
  rows.resize(static_cast<std::size_t>(kFlowInputs * source_.cols()));
  workspace_.forEachBlock(source_.cols(), [&](Scratch&, long begin, long count) {
    read(source_, begin, count, nearest_target_.data() + begin, rows.data());
  });
  return {rows.data(), kFlowInputs, source_.cols()};
}

RowsView Surroundings::of(const Points& queries, std::vector<float>& rows) const {
  rows.resize(static_cast<std::size_t>(kFlowInputs * queries.cols()));
  workspace_.forEachBlock(queries.cols(), [&](Scratch& scratch, long begin, long count) {
    workspace_.kernels().nearest(queries.data() + 3 * begin, count, target_.data(), target_.cols(),
                                 scratch.nearest.data());
    read(queries, begin, count, scratch.nearest.data(), rows.data());
  });
  return {rows.data(), kFlowInputs, queries.cols()};
}

/// Of a block of queries, whose nearest points of the target are known.
void Surroundings::read(const Points& queries, long begin, long count, const int* nearest,
                        float* rows) const {
  float sums[kBlockRows * kNeighbourhoods * kAveraged];
  workspace_.kernels().neighbourhoodSums(queries.data() + 3 * begin, count, source_.data(),
                                         values_.data(), source_.cols(),
                                         -0.5F / (kFlowScales[0] * kFlowScales[0]), sums);
  const float ratio = static_cast<float>(source_.cols()) / static_cast<float>(target_.cols());
  for (long q = 0; q < count; ++q) {
    Eigen::Map<Eigen::Matrix<float, kFlowInputs, 1>> row(rows + kFlowInputs * (begin + q));
    const auto query = queries.col(begin + q);
    row.head<3>() = query;
    auto shares = row.segment<kScales>(3);
    Eigen::Map<Eigen::Matrix<float, 3, kFlowVectors>> vectors(row.data() + 3 + kScales);
    vectors.col(0) = target_.col(nearest[q]) - query;
    for (int scale = 0; scale < kScales; ++scale) {
      const Eigen::Map<const Eigen::Matrix<float, kAveraged, 1>> sum(
          sums + kAveraged * (kNeighbourhoods * q + scale));
      const float weight = std::max(sum[kOne], std::numeric_limits<float>::min());
      shares[scale] = ratio * sum[kBackCount] / weight;
      vectors.col(1 + 2 * scale) = sum.segment<3>(kToTarget) / weight;
      vectors.col(2 + 2 * scale) = sum.segment<3>(kFromBack) / (sum[kBackCount] + kFlowFewest);
    }
    row.tail<kFlowVectors>() = vectors.colwise().norm();
  }
}

}  // namespace unirit
