// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <nodelet/NodeletUnload.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <string>

#include "client.hpp"

namespace unirit::test {
namespace {

geometry_msgs::TransformStamped edge() {
  geometry_msgs::TransformStamped edge = tf2::eigenToTransform(truePose());
  edge.header.frame_id = kCameraFrame;
  edge.header.stamp = ros::Time::now();
  edge.child_frame_id = kOrganFrame;
  return edge;
}

/// Registers new clouds until one ends so; the node needs time to notice who came and who went.
void expectSoon(Client& client, unsigned status, const std::string& words) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  RegistrationResult result;
  do {
    result = client.sendAndRegister(truePose()).result;
    if (result.status == status && result.message.find(words) != std::string::npos) return;
    ros::WallDuration(0.1).sleep();
  } while (ros::WallTime::now() < end);
  ADD_FAILURE() << "status " << int{result.status} << ": " << result.message;
}

void expectRegisters(Client& client) { expectSoon(client, RegistrationResult::SUCCEEDED, ""); }

void expectRefusedFor(Client& client, const std::string& publisher) {
  expectSoon(client, RegistrationResult::INVALID_INPUT,
             std::string("frame '") + kOrganFrame + "' already has parent '" + kCameraFrame +
                 "' on /tf, by node '" + publisher + "'");
}

TEST(Edge, isLeftToAnotherNodeForAsLongAsThatPublishesIt) {
  Client client("/alone");
  client.sendOrgan(organCloud());
  ros::NodeHandle nh;
  tf2_ros::TransformBroadcaster broadcaster;
  auto timer = nh.createWallTimer(ros::WallDuration(0.05),
                                  [&](const auto&) { broadcaster.sendTransform(edge()); });
  expectRefusedFor(client, ros::this_node::getName());
  timer.stop();
  expectRegisters(client);
}

TEST(Edge, isLeftToAnotherNodeletOfTheSameManager) {
  Client left("/left"), right("/right");
  left.sendOrgan(organCloud());
  right.sendOrgan(organCloud());
  expectRegisters(left);
  expectRefusedFor(right, "/shared_manager");

  // What it publishes itself comes back to it as well, and is no other's
  EXPECT_EQ(left.sendAndRegister(truePose()).result.status, RegistrationResult::SUCCEEDED);

  nodelet::NodeletUnload unload;
  unload.request.name = "/left";
  ASSERT_TRUE(callService("/shared_manager/unload_nodelet", unload));
  expectRegisters(right);
}

TEST(Edge, thatIsStaticIsLeftToItsPublisherForGood) {
  Client client("/alone");
  client.sendOrgan(organCloud());
  tf2_ros::StaticTransformBroadcaster broadcaster;
  broadcaster.sendTransform(edge());
  expectRefusedFor(client, ros::this_node::getName());
}

}  // namespace
}  // namespace unirit::test
