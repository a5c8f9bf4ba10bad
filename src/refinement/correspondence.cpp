// SPDX-License-Identifier: BSD-3-Clause
#include "correspondence.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace unirit {
namespace {

constexpr float kReach = 4.0F;           // affinities beyond so many sigma are below 4e-4
constexpr float kFarAway = 1e6F;         // where the padding lies
constexpr float kSourceOutliers = 0.1F;  // background of the source's side over the target's
constexpr float kBoxVariance = 12.0F;    // side^2 over variance of a uniformly filled box
constexpr float kFlatVariance = 1e-4F;   // no target is flatter

/// The source points that a thread takes together, whatever the number of threads.
struct Chunk {
  static constexpr long kPoints = 64;
  static long count(const PointCloud& source) { return (source.size() + kPoints - 1) / kPoints; }

  Chunk(long index, const PointCloud& source)
      : begin(index * kPoints), end(std::min(begin + kPoints, source.size())) {}

  long begin, end;
};

/// Sorts indices so that every kPointBlock of them lie close together: halves along the longest
/// side until a block is left.
void sortIntoBlocks(const Points& points, int* begin, int* end) {
  const long count = end - begin;
  if (count <= kPointBlock) return;
  Eigen::Vector3f lowest = points.col(*begin), highest = lowest;
  for (const int* index = begin; index != end; ++index) {
    lowest = lowest.cwiseMin(points.col(*index));
    highest = highest.cwiseMax(points.col(*index));
  }
  Eigen::Index axis = 0;
  (highest - lowest).maxCoeff(&axis);
  const long blocks = (count + kPointBlock - 1) / kPointBlock;
  int* middle = begin + blocks / 2 * kPointBlock;
  std::nth_element(begin, middle, end,
                   [&](int a, int b) { return points(axis, a) < points(axis, b); });
  sortIntoBlocks(points, begin, middle);
  sortIntoBlocks(points, middle, end);
}

/// Position and normal as the kernels read them.
Eigen::Matrix<float, 6, 1> oriented(const PointCloud& cloud, Eigen::Index i) {
  Eigen::Matrix<float, 6, 1> point;
  point << cloud.points.col(i), cloud.normals.col(i);
  return point;
}

}  // namespace

void CorrespondenceEstimator::reserve(long target_count) {
  target_count_ = target_count;
  padded_ = inWholeBlocks(target_count);
  targets_.ensure(static_cast<std::size_t>(6 * padded_));
  target_weights_.ensure(static_cast<std::size_t>(padded_));
}

void CorrespondenceEstimator::aimAt(const PointCloud& target) {
  reserve(target.size());
  order_.resize(static_cast<std::size_t>(target_count_));
  std::iota(order_.begin(), order_.end(), 0);
  sortIntoBlocks(target.points, order_.data(), order_.data() + order_.size());
  std::fill_n(targets_.data(), 3 * padded_, kFarAway);
  std::fill_n(targets_.data() + 3 * padded_, 3 * padded_, 0.0F);
  for (long j = 0; j < target_count_; ++j) {
    const Eigen::Matrix<float, 6, 1> point = oriented(target, order_[static_cast<std::size_t>(j)]);
    for (int k = 0; k < 6; ++k) row(k)[j] = point[k];
  }
  boundBlocks();
  const Eigen::Vector3f middle = centroid(target.points);
  Eigen::Matrix3f covariance = Eigen::Matrix3f::Zero();
  for (long j = 0; j < target_count_; ++j) {
    const Eigen::Vector3f offset = target.points.col(j) - middle;
    covariance += offset * offset.transpose();
  }
  covariance /= static_cast<float>(target_count_);
  covariance.diagonal().array() += kFlatVariance;
  volume_ = std::sqrt(kBoxVariance * kBoxVariance * kBoxVariance * covariance.determinant());
}

/// A ball around each block; some far away make up the number.
void CorrespondenceEstimator::boundBlocks() {
  const long count = padded_ / kPointBlock;
  Balls far_away = Balls::Zero();
  far_away.leftCols<3>() = kFarAway;
  balls_.assign(static_cast<std::size_t>((count + kBallsAtOnce - 1) / kBallsAtOnce), far_away);
  for (long b = 0; b < count; ++b) {
    const long first = b * kPointBlock;
    const long size = std::min(kPointBlock, target_count_ - first);
    Eigen::Matrix<float, 3, Eigen::Dynamic, 0, 3, kPointBlock> members(3, size);
    for (int axis = 0; axis < 3; ++axis) {
      members.row(axis) = Eigen::Map<const Eigen::RowVectorXf>(row(axis) + first, size);
    }
    const Eigen::Vector3f centre = members.rowwise().mean();
    const float radius = (members.colwise() - centre).colwise().norm().maxCoeff();
    balls_[static_cast<std::size_t>(b / kBallsAtOnce)].row(b % kBallsAtOnce)
        << centre.transpose().array(),
        radius;
  }
}

float* CorrespondenceEstimator::row(int index) { return targets_.data() + index * padded_; }

OrientedPointsView CorrespondenceEstimator::view() const {
  const float* first = targets_.data();
  return {{first, first + padded_, first + 2 * padded_},
          {first + 3 * padded_, first + 4 * padded_, first + 5 * padded_}};
}

/// Writes the blocks that reach near the point; how many.
long CorrespondenceEstimator::blocksNear(const Eigen::Vector3f& point, float reach,
                                         int* nearby) const {
  long count = 0;
  int block = 0;
  for (const Balls& balls : balls_) {
    const Eigen::Array<float, kBallsAtOnce, 1> beyond =
        (balls.col(0) - point.x()).square() + (balls.col(1) - point.y()).square() +
        (balls.col(2) - point.z()).square() - (balls.col(3) + reach).square();
    for (long b = 0; b < kBallsAtOnce; ++b) {
      nearby[count] = block++;  // written over unless it is near: no branch to guess
      count += beyond[b] <= 0.0F ? 1 : 0;
    }
  }
  return count;
}

int* CorrespondenceEstimator::nearbyOf(Eigen::Index source) {
  return nearby_.data() + static_cast<std::size_t>(source) * balls_.size() * kBallsAtOnce;
}

long& CorrespondenceEstimator::countOf(Eigen::Index source) {
  return nearby_counts_[static_cast<std::size_t>(source)];
}

/// The blocks of targets near each source point, and room for its affinities to them.
void CorrespondenceEstimator::findNearby(const PointCloud& source, float reach) {
  const long chunks = Chunk::count(source);
  nearby_counts_.resize(static_cast<std::size_t>(source.size()));
  nearby_.resize(nearby_counts_.size() * balls_.size() * kBallsAtOnce);
  team_.forEach(chunks, [&](int, long index) {
    const Chunk chunk(index, source);
    for (long i = chunk.begin; i < chunk.end; ++i) {
      countOf(i) = blocksNear(source.points.col(i), reach, nearbyOf(i));
    }
  });
  affinities_.resize(static_cast<std::size_t>(chunks));
  for (long index = 0; index < chunks; ++index) {
    const Chunk chunk(index, source);
    long blocks = 0;
    for (long i = chunk.begin; i < chunk.end; ++i) {
      blocks += countOf(i);
    }
    affinities_[static_cast<std::size_t>(index)].ensure(
        static_cast<std::size_t>(blocks * kPointBlock));
  }
}

/// Affinities to what is near, and their sums: over the source for each target (into the target
/// weights), over the target for each source.
void CorrespondenceEstimator::findAffinities(const PointCloud& source,
                                             const AffinityView& affinity) {
  const long chunks = Chunk::count(source);
  chunk_sums_.ensure(static_cast<std::size_t>(chunks * padded_));
  source_sums_.resize(static_cast<std::size_t>(source.size()));
  team_.forEach(chunks, [&](int, long index) {
    const Chunk chunk(index, source);
    float* values = affinities_[static_cast<std::size_t>(index)].data();
    float* sums = chunk_sums_.data() + index * padded_;
    std::fill_n(sums, padded_, 0.0F);
    for (long i = chunk.begin; i < chunk.end; ++i) {
      source_sums_[static_cast<std::size_t>(i)] = kernels_.affinities(
          oriented(source, i).data(), view(), nearbyOf(i), countOf(i), affinity, values, sums);
      values += countOf(i) * kPointBlock;
    }
  });
  Eigen::Map<Eigen::ArrayXf> totals(target_weights_.data(), padded_);
  totals.setZero();
  for (long chunk = 0; chunk < chunks; ++chunk) {
    totals += Eigen::Map<const Eigen::ArrayXf>(chunk_sums_.data() + chunk * padded_, padded_);
  }
}

/// From the sums of the affinities, while the target weights still are those.
float CorrespondenceEstimator::fit(const Eigen::RowVectorXf& visibility, float target_background,
                                   float source_background) const {
  const Eigen::Map<const Eigen::ArrayXf> target_sums(target_weights_.data(), target_count_);
  const Eigen::Map<const Eigen::ArrayXf> source_sums(source_sums_.data(), visibility.size());
  const float target = (target_sums + target_background).log().mean();
  const float source =
      ((source_sums + source_background).log() * visibility.transpose().array()).sum();
  return target + source / std::max(visibility.sum(), 1.0F);
}

void CorrespondenceEstimator::estimate(const PointCloud& source,
                                       const Eigen::RowVectorXf& visibility,
                                       const Attraction& attraction,
                                       Correspondences& correspondences) {
  findNearby(source, kReach * attraction.sigma);
  findAffinities(source, {-0.5F / (attraction.sigma * attraction.sigma), attraction.normals});

  // Responsibilities are affinities over their sums and a uniform background
  const float spread = 2.0F * static_cast<float>(M_PI) * attraction.sigma * attraction.sigma;
  const float background = attraction.outlier_share / (1.0F - attraction.outlier_share) * spread *
                           std::sqrt(spread) / volume_;
  const float target_background = background * static_cast<float>(source.size());
  const float source_background = kSourceOutliers * background * static_cast<float>(target_count_);
  correspondences.fit = fit(visibility, target_background, source_background);
  const float target_share = 1.0F / (1.0F + attraction.symmetry);
  Eigen::Map<Eigen::ArrayXf> target_weights(target_weights_.data(), padded_);
  target_weights = target_share / (target_weights + target_background);

  correspondences.mass.resize(source.size());
  correspondences.positions.resize(3, source.size());
  correspondences.normals.resize(3, source.size());
  const long chunks = Chunk::count(source);
  team_.forEach(chunks, [&](int, long index) {
    const Chunk chunk(index, source);
    const float* values = affinities_[static_cast<std::size_t>(index)].data();
    for (long i = chunk.begin; i < chunk.end; ++i) {
      const float source_weight = (1.0F - target_share) * visibility[i] /
                                  (source_sums_[static_cast<std::size_t>(i)] + source_background);
      Eigen::Matrix<float, 7, 1> sums;
      kernels_.gather(values, view(), nearbyOf(i), countOf(i), target_weights_.data(),
                      source_weight, sums.data());
      values += countOf(i) * kPointBlock;
      const bool any = sums[0] > 0.0F;
      correspondences.mass[i] = sums[0];
      correspondences.positions.col(i) =
          any ? Eigen::Vector3f(sums.segment<3>(1) / sums[0]) : source.points.col(i).eval();
      correspondences.normals.col(i) = sums.tail<3>().stableNormalized();
    }
  });
}

}  // namespace unirit
