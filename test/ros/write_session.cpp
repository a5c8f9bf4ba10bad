// SPDX-License-Identifier: BSD-3-Clause
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <rosbag/bag.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdio>
#include <exception>

#include "demo_scene.hpp"
#include "session.hpp"
#include "test_clouds.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit::test {
namespace {

const ros::Time kBegin(1000.0);
constexpr double kFirstView = 1.0;   // after the begin [s]; the organ and the guess come before
constexpr double kViewPeriod = 0.2;  // [s]

/// Records a phantom that moves before a camera: a short session as rosbag record would.
void writeSession(const std::string& path) {
  const Surface phantom = makePhantom("liver", 1, 2000);
  SceneSettings settings;
  settings.camera.width = 80;
  settings.camera.height = 60;
  const DemoScene scene(phantom, settings);

  rosbag::Bag bag(path, rosbag::bagmode::Write);
  tf2_msgs::TFMessage transforms;
  transforms.transforms.push_back(tf2::eigenToTransform(scene.cameraPose()));
  transforms.transforms[0].header.frame_id = "world";
  transforms.transforms[0].header.stamp = kBegin;
  transforms.transforms[0].child_frame_id = kCameraFrame;
  bag.write("/tf_static", kBegin, transforms);
  bag.write("/unirit/preoperative", kBegin, message(phantom.vertices.points, kOrganFrame, kBegin));

  geometry_msgs::PoseWithCovarianceStamped guess;
  guess.header.frame_id = "world";
  guess.header.stamp = kBegin + ros::Duration(kFirstView / 2.0);
  guess.pose.pose = tf2::toMsg(scene.roughPose());
  bag.write("/unirit/initial_guess", guess.header.stamp, guess);

  for (int i = 0; i < kSessionViews; ++i) {
    const double t = kFirstView + i * kViewPeriod;
    const ros::Time stamp = kBegin + ros::Duration(t);
    bag.write("/unirit/intraoperative", stamp,
              message(scene.viewAt(t).cloud.points, kCameraFrame, stamp));
  }
}

}  // namespace
}  // namespace unirit::test

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    unirit::test::writeSession(argv[1]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
