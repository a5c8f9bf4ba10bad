// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "unirit/point_cloud.hpp"
#include "workspace.hpp"

namespace unirit {

/// The way from points of one cloud to the nearest ones of another, as the network reads it.
class NearestOffsets {
 public:
  /// Sets the other cloud. Its order does not matter: among points equally near, the one of the
  /// smaller coordinates is taken.
  void setOthers(const Points& others);

  /// Of `count` points from `begin` on, in the scratch's inputs: x y z, then the offset.
  RowsView rows(const Points& points, long begin, long count, Scratch& scratch,
                const Kernels& kernels) const;

 private:
  std::vector<std::array<float, 3>> others_;  ///< sorted
};

}  // namespace unirit
