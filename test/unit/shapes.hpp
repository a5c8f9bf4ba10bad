// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <vector>

#include "unirit/point_cloud.hpp"
#include "unirit/random.hpp"
#include "unirit/sampling.hpp"

namespace unirit::test {

/// Points on an ellipsoid with a bump, about 0.2 m long: no symmetry, so a pose is well defined.
inline Points bumpyEllipsoid(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  Points points(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d d = random.direction();
    const double bump = d.x() > 0.6 && d.y() > 0.2 ? 1.3 : 1.0;
    points.col(i) = (bump * Eigen::Vector3d(0.10, 0.06, 0.04).cwiseProduct(d)).cast<float>();
  }
  return points;
}

/// The same points in another sequence.
inline Points shuffled(const Points& points, std::uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Index> order;
  for (Eigen::Index i = 0; i < points.cols(); ++i) order.push_back(i);
  for (std::size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1],
              order[static_cast<std::size_t>(random.below(static_cast<std::int64_t>(i)))]);
  }
  return select(points, order);
}

/// A closed box of the given side lengths, corner at the origin, faces outwards.
inline Surface box(const Eigen::Vector3f& sides) {
  Surface box;
  box.vertices.points.resize(3, 8);
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3f corner(static_cast<float>(i & 1), static_cast<float>((i >> 1) & 1),
                                 static_cast<float>((i >> 2) & 1));
    box.vertices.points.col(i) = corner.cwiseProduct(sides);
  }
  box.faces.resize(3, 12);
  box.faces << 0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1,  //
      2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7,           //
      3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5;
  return box;
}

}  // namespace unirit::test
