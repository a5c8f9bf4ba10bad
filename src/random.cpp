// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/random.hpp"

#include <cmath>

namespace unirit {

std::uint64_t Random::next() {
  std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

double Random::uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(next() >> 11U) * 0x1.0p-53;
}

std::int64_t Random::below(std::int64_t count) {
  return static_cast<std::int64_t>(uniform() * static_cast<double>(count));
}

double Random::normal() {  // Box-Muller; 1 - u keeps the logarithm finite
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * M_PI * uniform());
}

Eigen::Vector3d Random::direction() {
  const double x = normal(), y = normal(), z = normal();
  return Eigen::Vector3d(x, y, z).normalized();
}

Eigen::Matrix3d Random::rotation(double largest) {
  const Eigen::Vector3d axis = direction();
  return Eigen::AngleAxisd(uniform(0.0, largest) * M_PI / 180.0, axis).toRotationMatrix();
}

Eigen::Vector3d Random::uniformVector(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Eigen::Vector3d vector;
  for (int i = 0; i < 3; ++i) vector[i] = uniform(low[i], high[i]);
  return vector;
}

}  // namespace unirit
