// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <limits>

#include "node_fixture.hpp"

namespace unirit::test {
namespace {

using Names = std::vector<std::string>;

Points seen() { return pointsOf(seenCloud(truePose(), {})); }

/// As many points again, this far from the organ.
Points withSurroundings(const Eigen::Vector3f& offset) {
  const Points near = seen();
  Points all(3, 2 * near.cols());
  all << near, near.colwise() + offset;
  return all;
}

RegistrationResult registerWith(const std::string& node, const Points& cloud) {
  return Client("/" + node)
      .callRegister(requestWith(organCloud(), message(cloud, kCameraFrame, {})))
      .result;
}

TEST(Preprocessing, countsThePointsThatEachStageLeaves) {
  Points cloud = seen();
  const auto size = static_cast<std::uint32_t>(cloud.cols());
  cloud(1, 3) = std::numeric_limits<float>::quiet_NaN();
  cloud.col(7).setZero();  // where the camera stands
  const RegistrationResult result = registerWith("uncropped", cloud);
  EXPECT_EQ(result.status, RegistrationResult::SUCCEEDED) << result.message;
  EXPECT_EQ(result.preprocessing_stages, (Names{"received", "valid", "outliers", "voxel"}));
  ASSERT_EQ(result.preprocessing_points.size(), 4U);
  EXPECT_EQ(result.preprocessing_points[0], size);
  EXPECT_EQ(result.preprocessing_points[1], size - 2);
  EXPECT_GT(result.preprocessing_points[3], size / 2);
  EXPECT_EQ(result.stages.at(0), "conversion");
  EXPECT_EQ(result.stages.at(1), "preprocessing");
}

TEST(Preprocessing, cropsToABoxInTheFrameNamed) {
  const Points cloud = withSurroundings({0.0F, 0.0F, 0.3F});
  const RegistrationResult lost = registerWith("boxed", cloud);
  EXPECT_EQ(lost.status, RegistrationResult::NO_TRANSFORM);
  EXPECT_TRUE(names(lost.message, "'table'") && names(lost.message, "'camera'")) << lost.message;

  // The table, seen from the camera, lies askew behind the organ: its z axis points at the camera
  tf2_ros::StaticTransformBroadcaster broadcaster;
  geometry_msgs::TransformStamped table = tf2::eigenToTransform(Eigen::Isometry3d(
      Eigen::Translation3d(0.0, 0.0, 0.45) * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX())));
  table.header.frame_id = kCameraFrame;
  table.child_frame_id = "table";
  broadcaster.sendTransform(table);
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  RegistrationResult result;
  do {
    result = registerWith("boxed", cloud);
  } while (result.status == RegistrationResult::NO_TRANSFORM && ros::WallTime::now() < end);
  EXPECT_EQ(result.status, RegistrationResult::SUCCEEDED) << result.message;
  ASSERT_GE(result.preprocessing_stages.size(), 3U);
  EXPECT_EQ(result.preprocessing_stages[2], "region");
  const auto inside = (cloud.row(2).array() <= 0.65F).count();
  EXPECT_EQ(result.preprocessing_points[2], static_cast<std::uint32_t>(inside));
  EXPECT_LT(inside, cloud.cols());

  const RegistrationResult nothing =
      registerWith("boxed", cloud.colwise() + Eigen::Vector3f(0, 0, 2));
  EXPECT_EQ(nothing.status, RegistrationResult::INVALID_INPUT);
  EXPECT_TRUE(names(nothing.message, "preprocessing/region leaves 0 of")) << nothing.message;
  EXPECT_EQ(nothing.preprocessing_points.back(), 0U);
}

TEST(Preprocessing, keepsWhatIsAroundTheStart) {
  const Points cloud = withSurroundings({0.5F, 0.0F, 0.0F});
  const RegistrationResult result = registerWith("surrounded", cloud);
  EXPECT_EQ(result.status, RegistrationResult::SUCCEEDED) << result.message;
  ASSERT_GE(result.preprocessing_stages.size(), 3U);
  EXPECT_EQ(result.preprocessing_stages[2], "margin");
  EXPECT_EQ(result.preprocessing_points[2], static_cast<std::uint32_t>(seen().cols()));

  const RegistrationResult elsewhere =
      registerWith("surrounded", seen().colwise() + Eigen::Vector3f(0.5F, 0.0F, 0.0F));
  EXPECT_EQ(elsewhere.status, RegistrationResult::INVALID_INPUT);
  EXPECT_TRUE(names(elsewhere.message, "preprocessing/margin leaves 0 of")) << elsewhere.message;
}

TEST(Preprocessing, doesNotCropAroundAStartTakenFromTheCloud) {
  RegisterRequest request =
      requestWith(organCloud(), message(withSurroundings({0.5F, 0, 0}), kCameraFrame, {}));
  request.use_initial_guess = false;
  const RegistrationResult result = Client("/surrounded").callRegister(request).result;
  EXPECT_EQ(result.start, "centroids");
  EXPECT_EQ(result.preprocessing_stages, (Names{"received", "valid", "outliers", "voxel"}));
}

TEST(Preprocessing, aRegionThatIsNoBoxIsAFaultThatNamesIt) {
  const RegistrationResult result = registerWith("misread", seen());
  EXPECT_EQ(result.status, RegistrationResult::FAILED);
  EXPECT_TRUE(names(result.message, "/misread/preprocessing/region is not a list of the 6 numbers"))
      << result.message;
}

}  // namespace
}  // namespace unirit::test
