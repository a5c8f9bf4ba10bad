// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

namespace unirit {

/// A small random generator (SplitMix64, Steele et al. 2014) whose numbers are the same with every
/// standard library, unlike std::normal_distribution's.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next();
  double uniform(double low = 0.0, double high = 1.0);
  /// Integer in [0, count).
  std::int64_t below(std::int64_t count);
  double normal();
  Eigen::Vector3d direction();
  /// Rotation about a random axis by an angle uniform in [0, largest] degrees.
  Eigen::Matrix3d rotation(double largest);
  Eigen::Vector3d uniformVector(const Eigen::Vector3d& low, const Eigen::Vector3d& high);

 private:
  std::uint64_t state_;
};

}  // namespace unirit
