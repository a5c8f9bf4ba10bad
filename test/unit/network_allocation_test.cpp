// SPDX-License-Identifier: BSD-3-Clause
#include "allocation_counter.hpp"
#include "network_inputs.hpp"

namespace unirit {
namespace {

using test::countAllocations;

class NetworkAllocation : public testing::Test {
 protected:
  void SetUp() override { test::requireCounting(); }
};

TEST_F(NetworkAllocation, theCounterCounts) {
  EXPECT_GT(countAllocations([] { Points(3, 1000).setZero(); }), 0);
  EXPECT_GT(countAllocations([] { std::vector<int>(1000).front() = 1; }), 0);
}

TEST_F(NetworkAllocation, nothingIsAllocatedAfterTheFirstCall) {
  const Points source = test::randomPoints(1100, 1);  // more than are read at once
  const Points target = test::randomPoints(700, 2);
  const Points queries = test::randomPoints(317, 3);
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    for (const int threads : {1, 2}) {
      Network network(test::loudWeights(pairing), {8, pairing}, threads);
      Points displacements;
      const auto forward = [&] {
        network.estimateRigid(source, target);
        network.estimateDisplacements(source, target, queries, displacements);
      };
      EXPECT_GT(countAllocations(forward), 0) << "the first call sizes the buffers";
      EXPECT_EQ(countAllocations(forward), 0) << toString(pairing) << ", " << threads << " threads";
    }
  }
}

}  // namespace
}  // namespace unirit
