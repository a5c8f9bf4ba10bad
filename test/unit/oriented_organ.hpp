// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "shapes.hpp"
#include "unirit/normals.hpp"

namespace unirit::test {

/// The bumpy ellipsoid about as large as the network knows organs (half extent 1), with outward
/// normals.
inline PointCloud orientedOrgan(Eigen::Index count, std::uint64_t seed) {
  PointCloud organ{10.0F * bumpyEllipsoid(count, seed), {}};
  organ.normals = outwardNormals(organ.points);
  return organ;
}

}  // namespace unirit::test
