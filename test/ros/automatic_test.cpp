// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_broadcaster.h>

#include "client.hpp"
#include "names.hpp"

namespace unirit::test {
namespace {

/// A camera that moves in the world, as /tf tells.
void broadcastCamera(const Eigen::Isometry3d& T_world_camera, ros::Time stamp) {
  static tf2_ros::TransformBroadcaster broadcaster;
  geometry_msgs::TransformStamped camera = tf2::eigenToTransform(T_world_camera);
  camera.header.frame_id = "world";
  camera.header.stamp = stamp;
  camera.child_frame_id = kCameraFrame;
  broadcaster.sendTransform(camera);
}

bool isOrganInWorld(const geometry_msgs::TransformStamped& transform) {
  return transform.header.frame_id == "world" && transform.child_frame_id == kOrganFrame;
}

constexpr double kStaleAfter = 5.0;  // [s], as automatic.test sets it

/// One node that registers each cloud by itself, in the world's frame.
class Automatic : public testing::Test {
 protected:
  Automatic() : client_("/automatic") { client_.sendOrgan(organCloud()); }

  /// The result of a cloud seen by a camera at T_world_camera, of an organ at T_world_organ.
  RegistrationResult see(const Eigen::Isometry3d& T_world_camera,
                         const Eigen::Isometry3d& T_world_organ) {
    const ros::Time stamp = ros::Time::now();
    broadcastCamera(T_world_camera, stamp);
    client_.sendCloud(seenCloud(T_world_camera.inverse() * T_world_organ, stamp));
    return client_.waitForResult([&](const auto& result) { return result.header.stamp == stamp; });
  }

  /// Guesses once and shows the camera at rest until a registration has used the guess, so that
  /// none is left, and another one starts from it: the first views may lack the organ.
  RegistrationResult start() {
    client_.sendGuess("world", truePose());
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
    RegistrationResult result;
    bool guessed = false;
    while (!(guessed && result.start == names::kStartAccepted) && ros::WallTime::now() < end) {
      result = see(Eigen::Isometry3d::Identity(), truePose());
      guessed = guessed || result.start == names::kStartGuess;
    }
    EXPECT_EQ(result.status, RegistrationResult::SUCCEEDED) << result.message;
    return result;
  }

  Client client_;
};

TEST_F(Automatic, acceptedPoseFollowsTheCameraThroughTheFixedFrame) {
  const auto first = start();
  const Eigen::Isometry3d T_world_camera =
      Eigen::Translation3d(0.3, 0.1, -0.1) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ());
  const auto second = see(T_world_camera, truePose());
  ASSERT_EQ(second.status, RegistrationResult::SUCCEEDED) << second.message;
  EXPECT_EQ(second.start, names::kStartAccepted);
  const double moved_by = (T_world_camera * poseOf(second.transform).translation() -
                           poseOf(first.transform).translation())
                              .norm();
  EXPECT_LT(moved_by, 0.1) << "the camera moved by 0.33 m, the organ did not";
  const ros::Time now = ros::Time::now();
  ASSERT_TRUE(client_.waitUntil([&] {
    return !client_.transforms.empty() && isOrganInWorld(client_.transforms.back()) &&
           client_.transforms.back().header.stamp > now;
  }));
  client_.look([&] {
    EXPECT_TRUE(poseOf(client_.transforms.back().transform)
                    .isApprox(T_world_camera * poseOf(second.transform), 1e-6));
  });
}

TEST_F(Automatic, newestCloudWins) {
  start();
  const int sent = 40;
  ros::Time last;
  for (int i = 0; i < sent; ++i) {
    last = ros::Time::now();
    broadcastCamera(Eigen::Isometry3d::Identity(), last);
    client_.sendCloud(seenCloud(truePose(), last));
  }
  client_.waitForResult([&](const auto& result) { return result.header.stamp == last; });
  client_.look([&] {
    EXPECT_LT(client_.results.size(), static_cast<std::size_t>(sent)) << "there was a backlog";
    for (std::size_t i = 1; i < client_.results.size(); ++i) {
      EXPECT_GE(client_.results[i].header.stamp, client_.results[i - 1].header.stamp);
      EXPECT_GT(client_.results[i].id, client_.results[i - 1].id);
    }
  });
}

TEST_F(Automatic, staleRegistrationIsWithdrawnOnce) {
  const auto accepted = start();
  const auto stale = client_.waitForResult(
      [](const auto& result) { return result.status == RegistrationResult::STALE; });
  EXPECT_EQ(stale.id, accepted.id);
  EXPECT_EQ(stale.header.stamp, accepted.header.stamp);
  EXPECT_TRUE(
      client_.waitUntil([&] { return client_.deformed.width == 0 && client_.rigid.width == 0; }));
  const auto answer = client_.callDeformPoints(kOrganFrame, organ());
  EXPECT_EQ(answer.status, RegistrationResult::STALE);
  EXPECT_TRUE(answer.points.empty());
  EXPECT_EQ(answer.registration_id, accepted.id);

  // A new registration does not start from it; until then no transform and no second notice
  const auto after = see(Eigen::Isometry3d::Identity(), truePose());
  EXPECT_EQ(after.start, names::kStartCentroids);
  client_.look([&] {
    int notices = 0;
    for (const auto& result : client_.results) {
      notices += result.status == RegistrationResult::STALE ? 1 : 0;
    }
    EXPECT_EQ(notices, 1);
    for (const auto& transform : client_.transforms) {
      if (!isOrganInWorld(transform) || transform.header.stamp >= after.header.stamp) continue;
      EXPECT_LE((transform.header.stamp - accepted.header.stamp).toSec(), kStaleAfter);
    }
  });
}

TEST_F(Automatic, cloudWithoutItsTransformIsRefusedNamingBothFrames) {
  start();
  sensor_msgs::PointCloud2 elsewhere = seenCloud(truePose(), ros::Time::now());
  elsewhere.header.frame_id = "unknown_camera";
  client_.sendCloud(elsewhere);
  const auto result = client_.waitForResult(
      [&](const auto& other) { return other.header.frame_id == "unknown_camera"; });
  EXPECT_EQ(result.status, RegistrationResult::NO_TRANSFORM);
  EXPECT_NE(result.message.find("'unknown_camera'"), std::string::npos) << result.message;
  EXPECT_NE(result.message.find("'world'"), std::string::npos) << result.message;
}

}  // namespace
}  // namespace unirit::test
