// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace unirit {

/// Threads that share out the items of a loop. Between loops they yield for a moment, then sleep,
/// and nobody waits for one that has not begun: on a busy machine OpenMP's threads, which spin,
/// made two threads six times slower than one.
class ThreadTeam {
 public:
  /// The caller is one of the `size` threads. Throws std::invalid_argument where size < 1.
  explicit ThreadTeam(int size);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  int size() const { return static_cast<int>(workers_.size()) + 1; }

  /// Calls work(thread, item) once for each item in [0, count), thread in [0, size()), and returns
  /// when all are done. `work` must not throw. Allocates no memory.
  template <class Work>
  void forEach(long count, const Work& work) {
    run(count, std::cref(work));
  }

 private:
  using Job = std::function<void(int, long)>;

  void run(long count, const Job& job);
  void serve(int thread);
  void takeItems(int thread, const Job& job);

  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable idle_;
  const Job* job_ = nullptr;  ///< open to workers; written under the mutex, as are the next three
  std::atomic<unsigned long> job_number_{0};
  std::atomic<int> busy_workers_{0};
  bool stopping_ = false;
  long count_ = 0;  ///< of the job; written while no worker is busy
  std::atomic<long> next_item_{0};
  std::vector<std::thread> workers_;
};

}  // namespace unirit
