// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <algorithm>

#include "client.hpp"

namespace unirit::test {
namespace {

/// The same clouds and start for every node.
RegisterResponse registerWith(const std::string& node) {
  return Client("/" + node).callRegister(requestWith(organCloud(), seenCloud(truePose(), {})));
}

/// Transforms need time to arrive.
RegisterResponse registerOnceAllFramesAreKnown(const std::string& node) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  RegisterResponse response;
  do {
    response = registerWith(node);
  } while (response.result.status == RegistrationResult::NO_TRANSFORM &&
           ros::WallTime::now() < end);
  return response;
}

void place(const std::string& sensor, const Eigen::Isometry3d& T_camera_sensor,
           tf2_ros::StaticTransformBroadcaster& broadcaster) {
  geometry_msgs::TransformStamped transform = tf2::eigenToTransform(T_camera_sensor);
  transform.header.frame_id = kCameraFrame;
  transform.child_frame_id = sensor;
  broadcaster.sendTransform(transform);
}

TEST(Sensor, whoseFrameIsUnknownIsARefusalNamingBothFrames) {
  const RegisterResponse response = registerWith("tracked");
  EXPECT_EQ(response.result.status, RegistrationResult::NO_TRANSFORM);
  for (const std::string name : {"'endoscope'", "'camera'"}) {
    EXPECT_NE(response.result.message.find(name), std::string::npos) << response.result.message;
  }
  EXPECT_TRUE(response.deformed.data.empty());
}

TEST(Sensor, standsWhereItsFrameIsAndElseAtTheCloudsOrigin) {
  const RegisterResponse untold = registerWith("untold");
  ASSERT_EQ(untold.result.status, RegistrationResult::SUCCEEDED) << untold.result.message;
  tf2_ros::StaticTransformBroadcaster broadcaster;
  place("endoscope", Eigen::Isometry3d(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX())),
        broadcaster);
  place("behind", Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.0, 2.0)), broadcaster);
  const RegisterResponse tracked = registerOnceAllFramesAreKnown("tracked");
  EXPECT_EQ(tracked.result.message, untold.result.message);
  EXPECT_EQ(tracked.deformed.data, untold.deformed.data);

  // What the camera cannot see from there, it did see: a place that is believed makes a difference
  const RegisterResponse misplaced = registerOnceAllFramesAreKnown("misplaced");
  EXPECT_FALSE(misplaced.deformed.data.empty()) << misplaced.result.message;
  EXPECT_NE(misplaced.deformed.data, untold.deformed.data);
}

TEST(Sensor, mayBeNone) {
  const RegisterResponse response = registerWith("sensorless");
  EXPECT_EQ(response.result.status, RegistrationResult::SUCCEEDED) << response.result.message;
  EXPECT_NE(response.deformed.data, registerWith("untold").deformed.data);
}

TEST(Refinement, aloneSaysHowSureItIs) {
  const RegisterResponse response = registerWith("unrefined");
  ASSERT_EQ(response.result.status, RegistrationResult::SUCCEEDED) << response.result.message;
  EXPECT_EQ(fieldIndex(response.deformed, "displacement"), 3);
  EXPECT_EQ(fieldIndex(response.deformed, "confidence"), -1);
  const std::vector<std::string>& stages = response.result.stages;
  EXPECT_EQ(std::count(stages.begin(), stages.end(), "refine"), 0);
  const std::vector<std::string> all = registerWith("untold").result.stages;
  EXPECT_EQ(std::count(all.begin(), all.end(), "refine"), 1);
}

}  // namespace
}  // namespace unirit::test
