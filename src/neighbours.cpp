// SPDX-License-Identifier: BSD-3-Clause
#include "neighbours.hpp"

#include <algorithm>

namespace unirit {

Eigen::MatrixXi nearestPoints(const Points& points) {
  const Neighbours neighbours(points);
  Eigen::MatrixXi nearest(std::min(kSurfaceNeighbours, points.cols()), points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const auto found = neighbours.find<kSurfaceNeighbours>(points.col(i));
    std::transform(found.indices.begin(), found.indices.begin() + nearest.rows(),
                   nearest.col(i).data(), [](std::size_t j) { return static_cast<int>(j); });
  }
  return nearest;
}

}  // namespace unirit
