// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <functional>

/// Counts the program's allocations. To be included by one source file of a program.
namespace unirit::test {

inline std::atomic<long> allocations{0};

}  // namespace unirit::test

// glibc lets a program put its own functions before these; operator new ends here as well. The
// sanitizers bring their own, so with them nothing is counted and the test is skipped.
#if defined(__GLIBC__) && !defined(UNIRIT_SANITIZE) && !defined(__SANITIZE_ADDRESS__)
#define UNIRIT_COUNTS_ALLOCATIONS
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++unirit::test::allocations;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) {
  ++unirit::test::allocations;
  return __libc_calloc(count, size);
}

void* realloc(void* memory, std::size_t size) {
  ++unirit::test::allocations;
  return __libc_realloc(memory, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++unirit::test::allocations;
  return __libc_memalign(alignment, size);
}
}
#endif

namespace unirit::test {

inline long countAllocations(const std::function<void()>& work) {
  const long before = allocations;
  work();
  return allocations - before;
}

/// For SetUp: skips the test where another allocator's calls are not counted.
inline void requireCounting() {
#ifndef UNIRIT_COUNTS_ALLOCATIONS
  GTEST_SKIP() << "this build has another allocator, whose calls are not counted";
#endif
}

}  // namespace unirit::test
