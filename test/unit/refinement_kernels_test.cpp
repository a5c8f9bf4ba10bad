// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "instruction_set_test.hpp"
#include "unirit/point_cloud.hpp"
#include "unirit/random.hpp"

namespace unirit {
namespace {

constexpr NormalUse kNormalUses[] = {NormalUse::kNone, NormalUse::kUnsigned, NormalUse::kSigned};

/// Targets as the kernels read them, with random positions in the unit cube and random normals.
struct Targets {
  explicit Targets(long count) : numbers(6, std::vector<float>(static_cast<std::size_t>(count))) {
    Random random(21);
    for (long j = 0; j < count; ++j) {
      const Eigen::Vector3d normal = random.direction();
      for (int axis = 0; axis < 3; ++axis) {
        at(axis, j) = static_cast<float>(random.uniform(-1.0, 1.0));
        at(3 + axis, j) = static_cast<float>(normal[axis]);
      }
    }
  }
  float& at(int row, long j) {
    return numbers[static_cast<std::size_t>(row)][static_cast<std::size_t>(j)];
  }
  double position(int axis, long j) { return static_cast<double>(at(axis, j)); }
  double normal(int axis, long j) { return static_cast<double>(at(3 + axis, j)); }
  OrientedPointsView view() const {
    return {{numbers[0].data(), numbers[1].data(), numbers[2].data()},
            {numbers[3].data(), numbers[4].data(), numbers[5].data()}};
  }
  std::vector<std::vector<float>> numbers;
};

constexpr float kSource[6] = {0.1F, -0.2F, 0.3F, 0.6F, 0.0F, -0.8F};
constexpr long kTargets = 7 * kPointBlock;
const std::vector<int> kSomeBlocks{5, 0, 2, 3};

bool isNamed(long j) {
  for (const int block : kSomeBlocks) {
    if (j / kPointBlock == block) return true;
  }
  return false;
}

/// What kernels.hpp says, in double precision.
double expectedAffinity(Targets& targets, long j, const AffinityView& view, double& sign) {
  double squared_distance = 0.0, cosine = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    squared_distance += std::pow(targets.position(axis, j) - static_cast<double>(kSource[axis]), 2);
    cosine += targets.normal(axis, j) * static_cast<double>(kSource[3 + axis]);
  }
  const double closeness = std::exp(static_cast<double>(view.exponent) * squared_distance);
  sign = view.normals != NormalUse::kNone && cosine < 0.0 ? -1.0 : 1.0;
  if (view.normals == NormalUse::kNone) return closeness;
  if (view.normals == NormalUse::kSigned && cosine < 0.0) return 0.0;
  return closeness * cosine * cosine;
}

class RefinementKernel : public InstructionSetTest {
 protected:
  /// Of kSource to the targets of kSomeBlocks; adds to the sums.
  static float affinities(const Targets& targets, const AffinityView& view,
                          std::vector<float>& values, std::vector<float>& sums) {
    values.resize(kSomeBlocks.size() * kPointBlock);
    return selectKernels().affinities(kSource, targets.view(), kSomeBlocks.data(),
                                      static_cast<long>(kSomeBlocks.size()), view, values.data(),
                                      sums.data());
  }

  /// e^x as the kernels know it: the affinity of points at distance 1.
  static float exponential(float x) {
    Targets targets(kPointBlock);
    for (long j = 0; j < kPointBlock; ++j) {
      for (int axis = 0; axis < 3; ++axis) targets.at(axis, j) = axis == 0 ? 1.0F : 0.0F;
    }
    const float origin[6] = {};
    const int block = 0;
    std::vector<float> sums(kPointBlock), affinities(kPointBlock);
    selectKernels().affinities(origin, targets.view(), &block, 1, {x, NormalUse::kNone},
                               affinities.data(), sums.data());
    for (const float affinity : affinities) EXPECT_EQ(affinity, sums[0]) << "another lane";
    return sums[0];
  }
};

TEST_P(RefinementKernel, AffinitiesAreThoseOfDoublePrecision) {
  Targets targets(kTargets);
  for (const NormalUse use : kNormalUses) {
    for (const float exponent : {-0.5F, -8.0F, -20.0F}) {
      const AffinityView view{exponent, use};
      std::vector<float> values, sums(kTargets, 0.25F);
      const float total = affinities(targets, view, values, sums);
      double expected_total = 0.0;
      for (std::size_t k = 0; k < values.size(); ++k) {
        const long j =
            kSomeBlocks[k / kPointBlock] * kPointBlock + static_cast<long>(k) % kPointBlock;
        double sign = 0.0;
        const double expected = expectedAffinity(targets, j, view, sign);
        expected_total += expected;
        EXPECT_NEAR(static_cast<double>(values[k]), sign * expected, 1e-6) << "target " << j;
        EXPECT_NEAR(static_cast<double>(sums[static_cast<std::size_t>(j)]), 0.25 + expected, 1e-6)
            << "target " << j;
      }
      EXPECT_NEAR(static_cast<double>(total), expected_total, 1e-6 * expected_total + 1e-12);
    }
  }
}

TEST_P(RefinementKernel, TargetsOfOtherBlocksAreLeftAlone) {
  Targets targets(kTargets);
  std::vector<float> values, sums(kTargets, 0.1F);
  affinities(targets, {-1.0F, NormalUse::kNone}, values, sums);
  for (long j = 0; j < kTargets; ++j) {
    EXPECT_EQ(sums[static_cast<std::size_t>(j)] == 0.1F, !isNamed(j)) << "target " << j;
  }
  EXPECT_EQ(selectKernels().affinities(kSource, targets.view(), nullptr, 0,
                                       {-1.0F, NormalUse::kNone}, nullptr, sums.data()),
            0.0F);
}

TEST_P(RefinementKernel, GatheredSumsAreThoseOfDoublePrecision) {
  Targets targets(kTargets);
  std::vector<float> weights;
  Random random(22);
  for (long j = 0; j < kTargets; ++j) weights.push_back(static_cast<float>(random.uniform()));
  for (const NormalUse use : kNormalUses) {
    for (const float source_weight : {0.0F, 0.7F}) {
      const AffinityView view{-4.0F, use};
      std::vector<float> values, target_sums(kTargets);
      affinities(targets, view, values, target_sums);
      std::vector<float> sums(7, std::nanf(""));  // to be overwritten
      selectKernels().gather(values.data(), targets.view(), kSomeBlocks.data(),
                             static_cast<long>(kSomeBlocks.size()), weights.data(), source_weight,
                             sums.data());
      double expected[7] = {};
      for (long j = 0; j < kTargets; ++j) {
        if (!isNamed(j)) continue;
        double sign = 0.0;
        const double weight =
            expectedAffinity(targets, j, view, sign) *
            static_cast<double>(weights[static_cast<std::size_t>(j)] + source_weight);
        expected[0] += weight;
        for (int axis = 0; axis < 3; ++axis) {
          expected[1 + axis] += weight * targets.position(axis, j);
          expected[4 + axis] += weight * sign * targets.normal(axis, j);
        }
      }
      for (std::size_t k = 0; k < 7; ++k) {
        EXPECT_NEAR(static_cast<double>(sums[k]), expected[k], 1e-6 * expected[0]) << "sum " << k;
      }
    }
  }
}

TEST_P(RefinementKernel, GaussiansAreThoseOfDoublePrecision) {
  Targets targets(kTargets);
  const Points queries = 0.7F * Points::Random(3, 5);
  std::vector<float> values(5 * kTargets, -1.0F);
  selectKernels().gaussians(queries.data(), 4, targets.view().position, kTargets, -3.0F,
                            values.data());
  for (long q = 0; q < 5; ++q) {
    for (long j = 0; j < kTargets; ++j) {
      double squared_distance = 0.0;
      for (int axis = 0; axis < 3; ++axis) {
        squared_distance +=
            std::pow(targets.position(axis, j) - static_cast<double>(queries(axis, q)), 2);
      }
      const double expected = q < 4 ? std::exp(-3.0 * squared_distance) : -1.0;  // one not asked
      EXPECT_NEAR(static_cast<double>(values[static_cast<std::size_t>(q * kTargets + j)]), expected,
                  2e-6);
    }
  }
}

TEST_P(RefinementKernel, NormalsOnTheOtherSideCountAsTheirUseSays) {
  Targets targets(kPointBlock);
  for (long j = 0; j < kPointBlock; ++j) {
    for (int k = 0; k < 3; ++k) {
      targets.at(k, j) = kSource[k];
      targets.at(3 + k, j) = -kSource[3 + k];
    }
  }
  const int block = 0;
  const std::vector<float> weights(kPointBlock, 1.0F);
  const auto gathered = [&](NormalUse use) {
    std::vector<float> values(kPointBlock), target_sums(kPointBlock), sums(7);
    selectKernels().affinities(kSource, targets.view(), &block, 1, {-1.0F, use}, values.data(),
                               target_sums.data());
    selectKernels().gather(values.data(), targets.view(), &block, 1, weights.data(), 0.0F,
                           sums.data());
    return sums;
  };
  EXPECT_NEAR(gathered(NormalUse::kNone)[0], 16.0F, 1e-5F);
  EXPECT_NEAR(gathered(NormalUse::kNone)[4], -16.0F * kSource[3], 1e-5F);
  EXPECT_NEAR(gathered(NormalUse::kUnsigned)[0], 16.0F, 1e-5F);
  EXPECT_NEAR(gathered(NormalUse::kUnsigned)[4], 16.0F * kSource[3], 1e-5F);
  EXPECT_EQ(gathered(NormalUse::kSigned), std::vector<float>(7, 0.0F));
}

TEST_P(RefinementKernel, ExponentialIsExactToItsToleranceDownToUnderflow) {
  double worst = 0.0;
  for (int step = 0; step <= 87 * 256; ++step) {
    const float x = -static_cast<float>(step) / 256.0F;
    const double expected = std::exp(static_cast<double>(x));
    worst = std::max(worst, std::abs(static_cast<double>(exponential(x)) / expected - 1.0));
  }
  EXPECT_LT(worst, 5e-6);
  EXPECT_EQ(exponential(0.0F), 1.0F);
  EXPECT_EQ(exponential(-1e-30F), 1.0F);
}

TEST_P(RefinementKernel, ExponentialIsZeroBeyondUnderflow) {
  for (const float x : {-87.1F, -100.0F, -1e4F, -1e20F, -3e38F}) EXPECT_EQ(exponential(x), 0.0F);
  EXPECT_EQ(exponential(-std::numeric_limits<float>::infinity()), 0.0F);
  EXPECT_GT(exponential(-87.0F), 1.5e-38F);
}

UNIRIT_ON_EVERY_INSTRUCTION_SET(RefinementKernel);

}  // namespace
}  // namespace unirit
