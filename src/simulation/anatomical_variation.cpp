// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/anatomical_variation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "unirit/random.hpp"

namespace unirit {
namespace {

using Eigen::Vector3d;

constexpr double kCutOff = 2.0;         // deviations
constexpr double kShortestWave = 0.8;   // over the extent
constexpr double kLongestWave = 1.6;    // over the extent
constexpr double kMostLipschitz = 0.6;  // below 1 the map point + displacement is one to one

struct Wave {
  Vector3d amplitude;  // [m]
  Vector3d direction;  // times the wave number [1/m]
  double phase = 0.0;
};
using Waves = std::array<Wave, 6>;

double cutNormal(double deviation, Random& random) {
  return deviation * std::clamp(random.normal(), -kCutOff, kCutOff);
}

/// Size and proportions; the logarithms of the proportions add up to zero, so the volume is the
/// size's.
Vector3d drawStretch(const AnatomicalVariation& variation, Random& random) {
  const double size = cutNormal(variation.size, random);
  Vector3d proportions;
  for (int axis = 0; axis < 3; ++axis) proportions[axis] = cutNormal(variation.proportions, random);
  return (proportions.array() - proportions.mean() + size).exp();
}

Waves drawWaves(double extent, double most_rms, Random& random) {
  Waves waves;
  double squares = 0.0;
  for (Wave& wave : waves) {
    const double length = extent * random.uniform(kShortestWave, kLongestWave);
    wave.direction = 2.0 * M_PI / length * random.direction();
    wave.amplitude = random.uniform(0.3, 1.0) * random.direction();
    wave.phase = random.uniform(0.0, 2.0 * M_PI);
    squares += wave.amplitude.squaredNorm() / 2.0;  // mean square of a wave over space
  }
  const double scale = random.uniform(0.4, 1.0) * most_rms / std::sqrt(squares);
  double lipschitz = 0.0;
  for (Wave& wave : waves) {
    wave.amplitude *= scale;
    lipschitz += wave.amplitude.norm() * wave.direction.norm();
  }
  const double cut = std::min(1.0, kMostLipschitz / std::max(lipschitz, 1e-12));
  for (Wave& wave : waves) wave.amplitude *= cut;
  return waves;
}

}  // namespace

Surface varyAnatomy(const Surface& surface, std::uint64_t seed,
                    const AnatomicalVariation& variation) {
  if (surface.vertices.size() == 0) throw std::invalid_argument("surface: has no vertices");
  if (!(variation.size >= 0.0 && variation.proportions >= 0.0 && variation.bend >= 0.0)) {
    throw std::invalid_argument("variation: its deviations must not be negative");
  }
  Random random(seed);
  const Points& points = surface.vertices.points;
  const Vector3d centre = centroid(points).cast<double>();
  const Vector3d stretch = drawStretch(variation, random);
  const Waves waves = drawWaves(extent(points), variation.bend * extent(points), random);

  Surface varied{{Points(3, points.cols()), {}}, surface.faces};
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3d p = points.col(i).cast<double>() - centre;
    Vector3d warped = p;
    for (const Wave& wave : waves) {
      warped += wave.amplitude * std::sin(wave.direction.dot(p) + wave.phase);
    }
    varied.vertices.points.col(i) = (centre + stretch.cwiseProduct(warped)).cast<float>();
  }
  return varied;
}

}  // namespace unirit
