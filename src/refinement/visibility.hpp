// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// How sure it is that an eye sees each sample of a closed surface that moves: whether the sample
/// faces the eye and no other part of the surface hides it. Lengths in half the surface's extent.
class Visibility {
 public:
  explicit Visibility(const Points& surface);

  /// A row in [0, 1]; ones where there is no eye. `moved`: the samples, in their sequence, with
  /// outward normals.
  Eigen::RowVectorXf of(const PointCloud& moved, const std::optional<Eigen::Vector3f>& eye) const;

  /// The same, written over what was known before; allocates nothing then.
  void update(const PointCloud& moved, const std::optional<Eigen::Vector3f>& eye,
              Eigen::RowVectorXf& visibility) const;

 private:
  std::vector<Eigen::Index> hiders_;  // samples that stand for the surface that hides others
};

}  // namespace unirit
