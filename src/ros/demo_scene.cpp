// SPDX-License-Identifier: BSD-3-Clause
#include "demo_scene.hpp"

#include <cmath>
#include <stdexcept>

#include "unirit/random.hpp"

namespace unirit {
namespace {

// Scanner and room have nothing in common: the organ's axes lie askew in the world, on a table.
const Eigen::Vector3d kOrganAt(0.2, -0.1, 1.0);  // [m]
const Eigen::Vector3d kOrganAxis(0.48, 0.6, 0.64);
constexpr double kOrganAngle = 0.7;  // [rad]
const Eigen::Vector3d kFromOrganToCamera(0.3, -0.5, 0.8);

Eigen::Isometry3d placeOrgan(const Points& organ) {
  return Eigen::Translation3d(kOrganAt) * Eigen::AngleAxisd(kOrganAngle, kOrganAxis) *
         Eigen::Translation3d(-centroid(organ).cast<double>());
}

}  // namespace

DemoScene::DemoScene(const Surface& organ, const SceneSettings& settings)
    : settings_(settings),
      organ_(organ),
      extent_(extent(organ.vertices.points)),
      T_world_preoperative_(placeOrgan(organ.vertices.points)),
      T_world_camera_(
          lookAt(kOrganAt + settings.camera_distance * extent_ * kFromOrganToCamera.normalized(),
                 kOrganAt, Eigen::Vector3d::UnitZ())),
      motion_(moved(T_world_preoperative_, organ.vertices.points), settings.motion, settings.seed) {
  if (organ.faces.cols() == 0) {
    throw std::invalid_argument("organ: has no faces, and the simulated camera needs a mesh");
  }
}

View DemoScene::viewAt(double t) const {
  Surface now;
  now.faces = organ_.faces;
  now.vertices.points = motion_.at(moved(T_world_preoperative_, organ_.vertices.points), t);
  const Eigen::Isometry3d T_camera_world = T_world_camera_.inverse();
  const auto seed = settings_.seed + static_cast<std::uint64_t>(std::llround(t * 1000.0));
  return {renderDepth(now, T_camera_world, settings_.camera, seed),
          moved(T_camera_world, now.vertices.points)};
}

Eigen::Isometry3d DemoScene::roughPose() const {
  Random random(settings_.seed);
  const Eigen::Vector3d centre =
      T_world_preoperative_ * centroid(organ_.vertices.points).cast<double>();
  const Eigen::AngleAxisd turn(settings_.guess_rotation * M_PI / 180.0, random.direction());
  const Eigen::Vector3d shift = settings_.guess_translation * extent_ * random.direction();
  return Eigen::Translation3d(centre + shift) * turn * Eigen::Translation3d(-centre) *
         T_world_preoperative_;
}

}  // namespace unirit
