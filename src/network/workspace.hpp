// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "aligned_floats.hpp"
#include "kernels.hpp"
#include "thread_team.hpp"
#include "unirit/network/architecture.hpp"

namespace unirit {

/// Points go through all layers of a stack in blocks of this many, while they are in the cache.
inline constexpr long kBlockRows = 48;

/// Numbers from row to row of a block: the widest layer and a cache line, as rows a power of two
/// apart would compete for the same lines of the cache.
inline constexpr long kBlockStride = 1024 + 16;

/// What one thread needs to bring a block of points through the network.
struct Scratch {
  AlignedFloats activations[2] = {AlignedFloats(kBlockRows * kBlockStride),
                                  AlignedFloats(kBlockRows* kBlockStride)};
  AlignedFloats maxima{kFeatureSize};
  AlignedFloats inputs{6 * kBlockRows};  ///< a point and what is read beside it
  std::vector<int> nearest = std::vector<int>(kBlockRows);
};

/// The kernels, the threads and their memory; allocated once.
class Workspace {
 public:
  Workspace(const Kernels& kernels, int threads)
      : kernels_(kernels), team_(threads), scratches_(static_cast<std::size_t>(threads)) {}

  const Kernels& kernels() const { return kernels_; }
  ThreadTeam& team() { return team_; }
  std::vector<Scratch>& scratches() { return scratches_; }

  /// Calls work(scratch, begin, count) for every block of `total` points, spread over the threads.
  template <class Work>
  void forEachBlock(long total, const Work& work) {
    team_.forEach((total + kBlockRows - 1) / kBlockRows, [&](int thread, long block) {
      const long begin = block * kBlockRows;
      work(scratches_[static_cast<std::size_t>(thread)], begin,
           std::min(kBlockRows, total - begin));
    });
  }

 private:
  const Kernels& kernels_;
  ThreadTeam team_;
  std::vector<Scratch> scratches_;
};

}  // namespace unirit
