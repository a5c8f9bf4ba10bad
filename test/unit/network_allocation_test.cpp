// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <functional>

#include "network_reference.hpp"

namespace {

std::atomic<long> allocations{0};

}  // namespace

// glibc lets a program put its own functions before these; operator new ends here as well. The
// sanitizers bring their own, so with them nothing is counted and the test is skipped.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define UNIRIT_COUNTS_ALLOCATIONS
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) {
  ++allocations;
  return __libc_realloc(memory, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
}
#endif

namespace unirit {
namespace {

long countAllocations(const std::function<void()>& work) {
  const long before = allocations;
  work();
  return allocations - before;
}

class NetworkAllocation : public testing::Test {
 protected:
  void SetUp() override {
#ifndef UNIRIT_COUNTS_ALLOCATIONS
    GTEST_SKIP() << "this build has another allocator, whose calls are not counted";
#endif
  }
};

TEST_F(NetworkAllocation, theCounterCounts) {
  EXPECT_GT(countAllocations([] { Points(3, 1000).setZero(); }), 0);
  EXPECT_GT(countAllocations([] { std::vector<int>(1000).front() = 1; }), 0);
}

TEST_F(NetworkAllocation, nothingIsAllocatedAfterTheFirstCall) {
  const Points source = reference::randomPoints(203, 1);
  const Points target = reference::randomPoints(131, 2);
  const Points queries = reference::randomPoints(317, 3);
  for (const int threads : {1, 2}) {
    Network network(reference::loudWeights(Pairing::kNearest), {}, threads);
    Points displacements;
    const auto forward = [&] {
      network.estimateRigid(source, target);
      network.estimateDisplacements(source, target, queries, displacements);
    };
    EXPECT_GT(countAllocations(forward), 0) << "the first call sizes the buffers";
    EXPECT_EQ(countAllocations(forward), 0) << threads << " threads";
  }
}

}  // namespace
}  // namespace unirit
