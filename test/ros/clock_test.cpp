// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <rosgraph_msgs/Clock.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_broadcaster.h>

#include "client.hpp"
#include "names.hpp"

namespace unirit::test {
namespace {

/// Sets the simulated time of all nodes; returns when this one has got it.
void setClock(double seconds) {
  static ros::NodeHandle nh;
  static ros::Publisher publisher = nh.advertise<rosgraph_msgs::Clock>("/clock", 10, true);
  rosgraph_msgs::Clock clock;
  clock.clock = ros::Time(seconds);
  publisher.publish(clock);
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  while (ros::Time::now() != clock.clock && ros::WallTime::now() < end) {
    ros::WallDuration(0.01).sleep();
  }
  ASSERT_EQ(ros::Time::now(), clock.clock);
}

/// Registers a cloud stamped now, with as many tries as messages and clock need to arrive.
RegistrationResult registerAt(Client& client, const Eigen::Isometry3d& pose) {
  const ros::Time stamp = ros::Time::now();
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  RegistrationResult result;
  do {
    client.sendCloud(seenCloud(pose, stamp));
    result = client.callRegister().result;
  } while ((result.header.stamp != stamp || result.status != RegistrationResult::SUCCEEDED) &&
           ros::WallTime::now() < end);
  EXPECT_EQ(result.status, RegistrationResult::SUCCEEDED) << result.message;
  return result;
}

TEST(Clock, turnedBackWithdrawsTheRegistrationAndForgetsTransforms) {
  setClock(100.0);
  Client client("/unirit");
  client.sendOrgan(organCloud());
  registerAt(client, truePose());
  ASSERT_TRUE(client.waitUntil([&] { return client.deformed.width > 0; }));
  ASSERT_EQ(client.callRegister().result.start, names::kStartAccepted);

  tf2_ros::TransformBroadcaster broadcaster;
  geometry_msgs::TransformStamped pointer = tf2::eigenToTransform(truePose());
  pointer.header.frame_id = kCameraFrame;
  pointer.header.stamp = ros::Time(100.0);
  pointer.child_frame_id = "pointer";
  const auto guessByPointer = [&] {
    RegisterRequest request = requestFrom(Eigen::Isometry3d::Identity());
    request.initial_guess.header.frame_id = "pointer";
    return client.callRegister(request).result;
  };
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  do {
    broadcaster.sendTransform(pointer);
  } while (guessByPointer().status != RegistrationResult::SUCCEEDED && ros::WallTime::now() < end);

  setClock(50.0);
  EXPECT_TRUE(
      client.waitUntil([&] { return client.deformed.width == 0 && client.rigid.width == 0; }));
  EXPECT_EQ(client.callDeformPoints(kOrganFrame, organ()).status, RegistrationResult::REFUSED);
  EXPECT_EQ(registerAt(client, truePose()).start, names::kStartCentroids);
  EXPECT_EQ(guessByPointer().status, RegistrationResult::NO_TRANSFORM);

  // Its transforms begin again at the new time
  EXPECT_TRUE(client.waitUntil([&] {
    return !client.transforms.empty() && client.transforms.back().child_frame_id == kOrganFrame &&
           client.transforms.back().header.stamp == ros::Time(50.0);
  }));
}

TEST(Clock, transformsAreNotRepeatedWhileTheClockStands) {
  setClock(200.0);
  Client client("/unirit");
  client.sendOrgan(organCloud());
  const auto result = registerAt(client, truePose());
  setClock(201.0);
  EXPECT_TRUE(client.waitUntil([&] {
    return !client.transforms.empty() && client.transforms.back().header.stamp == ros::Time(201.0);
  }));
  client.callRegister();
  client.look([&] {
    ros::Time last;
    for (const auto& transform : client.transforms) {
      if (transform.header.stamp < result.header.stamp) continue;
      EXPECT_GT(transform.header.stamp, last);
      last = transform.header.stamp;
    }
  });
}

}  // namespace
}  // namespace unirit::test
