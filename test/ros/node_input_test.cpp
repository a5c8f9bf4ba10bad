// SPDX-License-Identifier: BSD-3-Clause
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <functional>
#include <limits>

#include "names.hpp"
#include "node_fixture.hpp"

namespace unirit::test {
namespace {

using sensor_msgs::PointCloud2;

struct BadCloud {
  const char* name;
  const char* words;  // of the sentence
  std::function<PointCloud2()> cloud;
};

void PrintTo(const BadCloud& bad, std::ostream* out) { *out << bad.name; }

/// The organ as seen, changed; a stamp of now.
PointCloud2 seenThen(const std::function<void(Points&)>& change) {
  Points points = pointsOf(seenCloud(truePose(), {}));
  change(points);
  return message(points, kCameraFrame, ros::Time::now());
}

PointCloud2 messageThen(const std::function<void(PointCloud2&)>& change) {
  PointCloud2 cloud = seenCloud(truePose(), ros::Time::now());
  change(cloud);
  return cloud;
}

const std::vector<BadCloud>& badClouds() {
  static const std::vector<BadCloud> clouds{
      {"empty", "is empty", [] { return seenThen([](Points& p) { p.resize(3, 0); }); }},
      {"tiny", "has 3 valid points",
       [] { return seenThen([](Points& p) { p.conservativeResize(3, 3); }); }},
      {"notANumber", "is empty",
       [] { return seenThen([](Points& p) { p.fill(std::numeric_limits<float>::quiet_NaN()); }); }},
      {"infinite", "is empty",
       [] { return seenThen([](Points& p) { p.fill(std::numeric_limits<float>::infinity()); }); }},
      {"planar", "is planar", [] { return seenThen([](Points& p) { p.row(2).fill(0.5F); }); }},
      {"collinear", "is collinear",
       [] { return seenThen([](Points& p) { p.bottomRows<2>().fill(0.5F); }); }},
      {"millimetres", "is it in millimetres",
       [] { return seenThen([](Points& p) { p *= 1000.0F; }); }},
      {"wrongType", "neither FLOAT32 nor FLOAT64",
       [] { return messageThen([](auto& m) { m.fields[0].datatype = 2; }); }},
      {"wrongSize", "bytes of data",
       [] { return messageThen([](auto& m) { m.data.resize(m.data.size() - 1); }); }},
      {"missingField", "lacks one of the fields",
       [] { return messageThen([](auto& m) { m.fields.pop_back(); }); }},
      {"noFrame", "names no frame",
       [] { return messageThen([](auto& m) { m.header.frame_id.clear(); }); }},
      {"noStamp", "has no stamp",
       [] { return messageThen([](auto& m) { m.header.stamp = ros::Time(); }); }},
      {"staleStamp", "s in the past",
       [] { return messageThen([](auto& m) { m.header.stamp -= ros::Duration(60.0); }); }},
      {"futureStamp", "s in the future",
       [] { return messageThen([](auto& m) { m.header.stamp += ros::Duration(60.0); }); }},
      {"organsFrame", "both clouds are in frame",
       [] { return messageThen([](auto& m) { m.header.frame_id = kOrganFrame; }); }},
  };
  return clouds;
}

class BadInput : public Node, public testing::WithParamInterface<BadCloud> {};

TEST_P(BadInput, isRefusedWithASentenceAndLeavesTheLastGoodRegistration) {
  client().sendCloud(GetParam().cloud());
  const auto response = client().registerUntil(
      [](const auto& result) { return result.status == RegistrationResult::INVALID_INPUT; });
  EXPECT_TRUE(names(response.result.message, GetParam().words)) << response.result.message;
  EXPECT_TRUE(response.deformed.data.empty());
  const auto answer = client().callDeformPoints(kOrganFrame, organ());
  EXPECT_EQ(answer.status, RegistrationResult::SUCCEEDED);
  EXPECT_GE(answer.registration_id, accepted_.result.id);
}

INSTANTIATE_TEST_SUITE_P(Clouds, BadInput, testing::ValuesIn(badClouds()),
                         [](const auto& tested) { return tested.param.name; });

TEST_F(Node, cloudThatFailsACheckIsShownWithValueAndLimit) {
  client().sendCloud(seenThen([](Points& p) { p *= 1000.0F; }));
  const auto response = client().registerUntil(
      [](const auto& result) { return result.status == RegistrationResult::INVALID_INPUT; });
  ASSERT_FALSE(response.result.checks.empty());
  EXPECT_EQ(response.result.checks.front().name, "age of the cloud [s]");
  EXPECT_TRUE(response.result.checks.front().passed);
  const auto& last = response.result.checks.back();
  EXPECT_EQ(last.name, "largest extent of a cloud over the organ's");
  EXPECT_GT(last.value, last.limit);
  EXPECT_FALSE(last.passed);
  EXPECT_TRUE(client().waitUntil(
      [&] { return client().refused.header.stamp == response.result.header.stamp; }));
}

TEST_F(Node, otherLayoutsRegisterAsThePlainOneDoes) {
  const auto plain = client().callRegister(requestWith(organCloud(), seenCloud(truePose(), {})));
  const Eigen::MatrixXd points = pointsOf(seenCloud(truePose(), {})).cast<double>();
  for (const bool float64 : {false, true}) {
    MessageLayout layout;
    layout.float64 = float64;
    layout.big_endian = true;
    layout.offset = 3;
    PointCloud2 other = message(points, layout);
    other.header.frame_id = kCameraFrame;
    const auto response = client().callRegister(requestWith(organCloud(), other));
    EXPECT_EQ(response.result.status, RegistrationResult::SUCCEEDED) << response.result.message;
    EXPECT_EQ(response.deformed.data, plain.deformed.data);
  }
}

TEST_F(Node, invalidPreoperativePointsKeepTheirPlaceInTheOutput) {
  Points holey = organ();
  holey(0, 5) = std::numeric_limits<float>::quiet_NaN();
  const auto response = client().callRegister(
      requestWith(message(holey, kOrganFrame, {}), seenCloud(truePose(), {})));
  ASSERT_EQ(response.result.status, RegistrationResult::SUCCEEDED) << response.result.message;
  EXPECT_EQ(response.deformed.width, organ().cols());
  EXPECT_EQ(pointsOf(response.deformed).cols(), organ().cols() - 1);
  const auto* numbers = reinterpret_cast<const float*>(response.deformed.data.data());
  EXPECT_TRUE(std::isnan(numbers[5 * 5]));
}

TEST_F(Node, guessInAnUnknownFrameIsRefusedNamingBothFrames) {
  RegisterRequest request = requestFrom(truePose());
  request.initial_guess.header.frame_id = "nowhere";
  const auto response = client().callRegister(request);
  EXPECT_EQ(response.result.status, RegistrationResult::NO_TRANSFORM);
  EXPECT_TRUE(names(response.result.message, "'nowhere'") &&
              names(response.result.message, "'camera'"))
      << response.result.message;
}

TEST_F(Node, guessNeverRestsOnTheNodesOwnTransform) {
  tf2_ros::StaticTransformBroadcaster broadcaster;
  geometry_msgs::TransformStamped tumour = tf2::eigenToTransform(Eigen::Isometry3d::Identity());
  tumour.header.frame_id = kOrganFrame;
  tumour.child_frame_id = "tumour";
  broadcaster.sendTransform(tumour);
  RegisterRequest request = requestFrom(truePose());
  request.initial_guess.header.frame_id = "tumour";
  const auto below = client().callRegister(request);
  EXPECT_EQ(below.result.status, RegistrationResult::NO_TRANSFORM) << below.result.message;
  request.initial_guess.header.frame_id = kOrganFrame;
  const auto itself = client().callRegister(request);
  EXPECT_EQ(itself.result.status, RegistrationResult::INVALID_INPUT) << itself.result.message;
}

TEST_F(Node, guessThatIsNoRotationIsRefused) {
  RegisterRequest request = requestFrom(truePose());
  request.initial_guess.pose.orientation.w += 1.0;
  const auto response = client().callRegister(request);
  EXPECT_EQ(response.result.status, RegistrationResult::INVALID_INPUT);
  EXPECT_TRUE(names(response.result.message, "quaternion")) << response.result.message;
}

TEST_F(Node, organFrameWithAnotherParentIsRefused) {
  tf2_ros::StaticTransformBroadcaster broadcaster;
  geometry_msgs::TransformStamped other = tf2::eigenToTransform(Eigen::Isometry3d::Identity());
  other.header.frame_id = "scanner";
  other.child_frame_id = "claimed_organ";
  broadcaster.sendTransform(other);
  client().sendOrgan(message(organ(), "claimed_organ", ros::Time(3.0)));
  const auto response = client().registerUntil(
      [](const auto& result) { return result.status == RegistrationResult::INVALID_INPUT; });
  EXPECT_TRUE(names(response.result.message, "'claimed_organ' already has parent 'scanner'"))
      << response.result.message;
}

}  // namespace
}  // namespace unirit::test
