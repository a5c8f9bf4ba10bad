// SPDX-License-Identifier: BSD-3-Clause
#include "responsibilities.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace unirit {
namespace {

constexpr Eigen::Index kBlock = 32;       // neighbouring source points that are skipped together
constexpr double kReach = 45.0;           // exp(-45) is nothing beside 1
constexpr double kLeastInReach = 1e-8;    // of a denominator; below it, what is far counts, too
constexpr double kLeastOutlier = 1e-250;  // target points out of reach of all explain nothing

/// The points in blocks of neighbours: halved along the longest side until they are few.
void sortIntoBlocks(const Eigen::Matrix3Xd& points, Eigen::Index* first, Eigen::Index* last) {
  if (last - first <= kBlock) return;
  Eigen::Vector3d low = points.col(*first), high = low;
  for (const Eigen::Index* i = first; i != last; ++i) {
    low = low.cwiseMin(points.col(*i));
    high = high.cwiseMax(points.col(*i));
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const Eigen::Index blocks = (last - first + kBlock - 1) / kBlock;
  Eigen::Index* middle = first + blocks / 2 * kBlock;
  std::nth_element(first, middle, last, [&](Eigen::Index a, Eigen::Index b) {
    return points(axis, a) < points(axis, b);
  });
  sortIntoBlocks(points, first, middle);
  sortIntoBlocks(points, middle, last);
}

/// Neighbouring source points, and the sphere around them. Where they are fewer than a block, the
/// rest are infinitely far.
struct Block {
  Eigen::Array<double, kBlock, 3> points;
  Eigen::Vector3d centre;
  double radius = 0.0;
  Eigen::Array<double, kBlock, 4> sums = Eigen::Array<double, kBlock, 4>::Zero();  // x, y, z, 1

  Block(const Eigen::Matrix3Xd& source, const Eigen::Index* indices, Eigen::Index count) {
    points.setConstant(std::numeric_limits<double>::infinity());
    for (Eigen::Index i = 0; i < count; ++i) points.row(i) = source.col(indices[i]).transpose();
    centre = points.topRows(count).colwise().mean().transpose();
    for (Eigen::Index i = 0; i < count; ++i) {
      radius = std::max(radius, (source.col(indices[i]) - centre).norm());
    }
  }
};

using Terms = Eigen::Array<double, kBlock, 1>;

/// The terms of one target point, block by block; those out of reach are left out.
class Denominator {
 public:
  Denominator(std::vector<Block>& blocks, double variance)
      : blocks_(blocks), scale_(-0.5 / variance), terms_(blocks.size()) {}

  /// Their sum.
  double sum(const Eigen::Vector3d& x, double reach) {
    near_.clear();
    double total = 0.0;
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      const Block& block = blocks_[i];
      if ((x - block.centre).norm() - block.radius > reach) continue;
      near_.push_back(i);
      terms_[i] =
          (((block.points.col(0) - x.x()).square() + (block.points.col(1) - x.y()).square() +
            (block.points.col(2) - x.z()).square()) *
           scale_)
              .exp();
      total += terms_[i].sum();
    }
    return total;
  }

  /// Adds each term's share of the target point to its source point.
  void share(const Eigen::Vector3d& x, double denominator) {
    for (const std::size_t i : near_) {
      const Terms shares = terms_[i] / denominator;
      for (int axis = 0; axis < 3; ++axis) blocks_[i].sums.col(axis) += x[axis] * shares;
      blocks_[i].sums.col(3) += shares;
    }
  }

 private:
  std::vector<Block>& blocks_;
  double scale_;
  std::vector<Terms> terms_;
  std::vector<std::size_t> near_;
};

}  // namespace

double Responsibilities::squaredDistances(const Eigen::Matrix3Xd& target,
                                          const Eigen::Matrix3Xd& source) const {
  return of_target.dot(target.colwise().squaredNorm()) +
         of_source.dot(source.colwise().squaredNorm()) -
         2.0 * weighted_targets.cwiseProduct(source).sum();
}

Responsibilities responsibilities(const Eigen::Matrix3Xd& source, const Eigen::Matrix3Xd& target,
                                  double variance, double outlier) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(source.cols()));
  std::iota(order.begin(), order.end(), 0);
  sortIntoBlocks(source, order.data(), order.data() + order.size());
  std::vector<Block> blocks;
  for (Eigen::Index i = 0; i < source.cols(); i += kBlock) {
    blocks.emplace_back(source, order.data() + i, std::min(kBlock, source.cols() - i));
  }

  Responsibilities sums;
  sums.of_target.resize(target.cols());
  Denominator denominators(blocks, variance);
  const double reach = std::sqrt(2.0 * kReach * variance);
  for (Eigen::Index n = 0; n < target.cols(); ++n) {
    const Eigen::Vector3d x = target.col(n);
    double sum = denominators.sum(x, reach);
    if (sum + outlier < kLeastInReach) {
      sum = denominators.sum(x, std::numeric_limits<double>::infinity());
    }
    const double denominator = sum + std::max(outlier, kLeastOutlier);
    denominators.share(x, denominator);
    sums.of_target[n] = sum / denominator;
    sums.log_sum += std::log(denominator);
  }

  sums.weighted_targets.resize(3, source.cols());
  sums.of_source.resize(source.cols());
  for (Eigen::Index i = 0; i < source.cols(); ++i) {
    const auto shares = blocks[static_cast<std::size_t>(i / kBlock)].sums.row(i % kBlock);
    const Eigen::Index m = order[static_cast<std::size_t>(i)];
    sums.weighted_targets.col(m) = shares.leftCols<3>().transpose().matrix();
    sums.of_source[m] = shares[3];
  }
  return sums;
}

}  // namespace unirit
