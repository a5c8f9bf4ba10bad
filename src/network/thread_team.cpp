// SPDX-License-Identifier: BSD-3-Clause
#include "thread_team.hpp"

#include <chrono>
#include <stdexcept>

namespace unirit {
namespace {

constexpr std::chrono::microseconds kPatience(100);

/// Waits for what may soon be true, while others may run: to fall asleep and be woken takes longer
/// than many a loop.
template <class Done>
void yieldUntil(const Done& done) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!done() && std::chrono::steady_clock::now() < end) std::this_thread::yield();
}

}  // namespace

ThreadTeam::ThreadTeam(int size) {
  if (size < 1) {
    throw std::invalid_argument("threads: must be at least 1");
  }
  for (int thread = 1; thread < size; ++thread) {
    workers_.emplace_back([this, thread] { serve(thread); });
  }
}

ThreadTeam::~ThreadTeam() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& worker : workers_) {
    worker.join();
  }
}

void ThreadTeam::run(long count, const Job& job) {
  const bool shared = count > 1 && !workers_.empty();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    count_ = count;
    next_item_ = 0;
    if (shared) {
      job_ = &job;
      ++job_number_;
    }
  }
  if (shared) {
    wake_.notify_all();
  }
  takeItems(0, job);

  // Closed to workers that have not begun; those that have finish their item
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    job_ = nullptr;
  }
  const auto done = [this] { return busy_workers_ == 0; };
  yieldUntil(done);
  std::unique_lock<std::mutex> lock(mutex_);
  idle_.wait(lock, done);
}

void ThreadTeam::serve(int thread) {
  unsigned long last_job = 0;
  while (true) {
    yieldUntil([&] { return job_number_ != last_job; });
    std::unique_lock<std::mutex> lock(mutex_);
    wake_.wait(lock, [&] { return stopping_ || (job_ != nullptr && job_number_ != last_job); });
    if (stopping_) {
      return;
    }
    last_job = job_number_;
    const Job& job = *job_;
    ++busy_workers_;
    lock.unlock();
    takeItems(thread, job);
    lock.lock();
    if (--busy_workers_ == 0) {
      idle_.notify_one();
    }
  }
}

void ThreadTeam::takeItems(int thread, const Job& job) {
  for (long item = next_item_++; item < count_; item = next_item_++) {
    job(thread, item);
  }
}

}  // namespace unirit
