// SPDX-License-Identifier: BSD-3-Clause
// Speed of the preprocessing on clouds of 500,000 points, as a depth camera sees them.
#include <algorithm>
#include <cmath>
#include <string>

#include "speed.hpp"
#include "unirit/preprocessing.hpp"
#include "unirit/simulation/depth_camera.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit::speed {
namespace {

constexpr Eigen::Index kCloudPoints = 500000;

const Surface& liver() {
  static const Surface surface = makePhantom("liver", 1);
  return surface;
}

Eigen::Isometry3d cameraPose() {
  const double distance = 1.6 * extent(liver().vertices.points);
  return lookAt(distance * Eigen::Vector3d(0.3, -0.5, 0.8).normalized(), {0, 0, 0}, {0, 0, 1});
}

/// The organ, filling the picture.
Points seenOrgan() {
  DepthCamera camera;
  camera.width = 1600;
  camera.height = 1200;
  camera.horizontal_field = 40.0;
  const Points seen = renderDepth(liver(), cameraPose().inverse(), camera, 1).points;
  return seen.leftCols(std::min(kCloudPoints, seen.cols()));
}

/// The organ before a wavy cavity, three times as wide, with flying pixels in between.
Points seenCavity() {
  constexpr Eigen::Index kRow = 800;
  const auto width = static_cast<float>(3.0 * extent(liver().vertices.points));
  const Points organ = seenOrgan();
  Random random(1);
  Points points(3, kCloudPoints);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const float x = width * (static_cast<float>(i % kRow) / kRow - 0.5F);
    const float y = width * (static_cast<float>(i / kRow) / kRow - 0.5F);
    const auto noise = static_cast<float>(0.001 * random.normal());
    points.col(i) << x, y, width + 0.03F * std::sin(20.0F * x) * std::cos(15.0F * y) + noise;
    if (i % 3 == 0) points.col(i) = organ.col(i * organ.cols() / kCloudPoints);
    if (i % 50 == 0) points(2, i) *= static_cast<float>(random.uniform(0.5, 1.0));
  }
  return points;
}

void preprocess(benchmark::State& state, const Points& points, double margin) {
  RegistrationSettings settings;
  settings.preprocessing.margin = margin;
  RawCloud raw{{points, {}, Eigen::Vector3f::Zero()}, points.cols()};
  raw.T_cloud_organ = cameraPose().inverse();
  Eigen::Index left = 0;
  for (auto _ : state) {
    left = unirit::preprocess(raw, liver().vertices.points, settings).cloud.size();
  }
  state.SetLabel(std::to_string(points.cols()) + " to " + std::to_string(left) + " points");
}

void preprocess_organ(benchmark::State& state) { preprocess(state, seenOrgan(), 0.0); }
void preprocess_cavity(benchmark::State& state) { preprocess(state, seenCavity(), 0.0); }
void preprocess_cavity_cropped(benchmark::State& state) { preprocess(state, seenCavity(), 0.3); }

BENCHMARK(preprocess_organ)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(preprocess_cavity)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(preprocess_cavity_cropped)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace unirit::speed
