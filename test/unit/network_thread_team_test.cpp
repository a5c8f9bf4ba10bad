// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <set>

#include "network/thread_team.hpp"

namespace unirit {
namespace {

TEST(ThreadTeam, everyItemIsDoneOnceInEveryLoop) {
  for (const int size : {1, 2, 5}) {
    ThreadTeam team(size);
    EXPECT_EQ(team.size(), size);
    for (long count = 0; count < 200; ++count) {
      std::vector<std::atomic<int>> done(static_cast<std::size_t>(count));
      team.forEach(count, [&](int, long item) { ++done[static_cast<std::size_t>(item)]; });
      for (const auto& times : done) {
        ASSERT_EQ(times, 1) << size << " threads, " << count << " items";
      }
    }
  }
}

TEST(ThreadTeam, everyThreadWorksUnderANumberOfItsOwn) {
  ThreadTeam team(3);
  std::vector<std::thread::id> ids(3);  // each written by the thread of its number alone
  std::atomic<int> begun{0};
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  team.forEach(3, [&](int thread, long) {
    ids.at(static_cast<std::size_t>(thread)) = std::this_thread::get_id();
    ++begun;
    while (begun < 3 && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::yield();
    }
  });
  EXPECT_EQ(ids[0], std::this_thread::get_id()) << "the caller works too";
  EXPECT_EQ(std::set(ids.begin(), ids.end()).size(), 3U);
  EXPECT_EQ(std::count(ids.begin(), ids.end(), std::thread::id()), 0);
}

TEST(ThreadTeam, aLoopEndsOnlyWhenItsLastItemHas) {
  ThreadTeam team(2);
  std::atomic<int> ended{0};
  team.forEach(2, [&](int thread, long) {
    std::this_thread::sleep_for(std::chrono::milliseconds(thread == 0 ? 1 : 30));
    ++ended;
  });
  EXPECT_EQ(ended, 2);
}

TEST(ThreadTeam, needsAThread) { EXPECT_THROW(ThreadTeam(0), std::invalid_argument); }

}  // namespace
}  // namespace unirit
