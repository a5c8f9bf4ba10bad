// SPDX-License-Identifier: BSD-3-Clause
#include "conversions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "refusal.hpp"
#include "result_message.hpp"
#include "test_clouds.hpp"

namespace unirit {
namespace {

using sensor_msgs::PointCloud2;
using test::message;
using test::MessageLayout;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::MatrixXd threePoints() {
  Eigen::MatrixXd points(3, 4);
  points << 0.5, -1.25, 3.0, 0.0, 2.0, 0.125, -7.5, 1.0, 0.25, 4.0, -0.0625, 2.0;
  return points;
}

void expectReadsBack(const MessageLayout& layout) {
  const ReceivedCloud received = fromMessage(message(threePoints(), layout), "cloud");
  EXPECT_EQ(received.cloud.points, threePoints().cast<float>());
  EXPECT_EQ(received.dropped(), 0);
}

/// The sentence with which the message is refused; empty where it is not.
std::string sentence(const PointCloud2& cloud) {
  try {
    fromMessage(cloud, "the cloud");
  } catch (const Refusal& refusal) {
    EXPECT_EQ(refusal.status(), Status::kInvalidInput);
    return refusal.what();
  }
  return "";
}

#define EXPECT_NAMES(text, words) EXPECT_NE((text).find(words), std::string::npos) << (text)

TEST(FromMessage, readsFloat32AndFloat64InEitherByteOrder) {
  for (const bool float64 : {false, true}) {
    for (const bool big_endian : {false, true}) {
      MessageLayout layout;
      layout.float64 = float64;
      layout.big_endian = big_endian;
      expectReadsBack(layout);
    }
  }
}

TEST(FromMessage, readsAnyOffsetPaddingAndRowGap) {
  MessageLayout layout;
  layout.offset = 5;
  layout.padding = 11;
  layout.height = 2;
  layout.row_gap = 7;
  expectReadsBack(layout);
}

TEST(FromMessage, readsFieldsInAnyOrder) {
  MessageLayout layout;
  layout.fields = {"z", "x", "y"};
  const ReceivedCloud received = fromMessage(message(threePoints(), layout), "cloud");
  const Points expected = threePoints().cast<float>();
  EXPECT_EQ(received.cloud.points.row(0), expected.row(1));
  EXPECT_EQ(received.cloud.points.row(1), expected.row(2));
  EXPECT_EQ(received.cloud.points.row(2), expected.row(0));
}

TEST(FromMessage, dropsPointsThatAreNotFiniteAndCountsThem) {
  Eigen::MatrixXd points = threePoints();
  points(0, 0) = kNan;
  points(2, 2) = -kInfinity;
  const ReceivedCloud received = fromMessage(message(points, MessageLayout()), "cloud");
  EXPECT_EQ(received.total, 4);
  EXPECT_EQ(received.dropped(), 2);
  EXPECT_EQ(received.kept, (std::vector<Eigen::Index>{1, 3}));
  EXPECT_TRUE(received.cloud.points.allFinite());
}

TEST(FromMessage, dropsDoublesBeyondSinglePrecision) {
  Eigen::MatrixXd points = threePoints();
  points(1, 3) = 1e300;
  MessageLayout layout;
  layout.float64 = true;
  EXPECT_EQ(fromMessage(message(points, layout), "cloud").dropped(), 1);
}

TEST(FromMessage, readsNormalsAsUnitVectorsOnlyWhereAllAreKnown) {
  Eigen::MatrixXd values(6, 4);
  values << threePoints(), 2.0 * threePoints();
  MessageLayout layout;
  layout.fields = {"x", "y", "z", "normal_x", "normal_y", "normal_z"};
  const ReceivedCloud known = fromMessage(message(values, layout), "cloud");
  ASSERT_EQ(known.cloud.normals.cols(), 4);
  EXPECT_TRUE(known.cloud.normals.colwise().norm().isOnes(1e-6));
  values(4, 1) = kNan;
  EXPECT_EQ(fromMessage(message(values, layout), "cloud").cloud.normals.cols(), 0);
}

TEST(FromMessage, readsAnEmptyCloudAsEmpty) {
  EXPECT_EQ(fromMessage(PointCloud2(), "cloud").cloud.size(), 0);
}

TEST(FromMessage, refusesAMissingField) {
  MessageLayout layout;
  layout.fields = {"x", "y", "intensity"};
  EXPECT_NAMES(sentence(message(threePoints(), layout)), "the cloud lacks");
}

TEST(FromMessage, refusesATypeThatIsNotFloatingPoint) {
  PointCloud2 cloud = message(threePoints(), MessageLayout());
  cloud.fields[1].datatype = sensor_msgs::PointField::INT32;
  EXPECT_NAMES(sentence(cloud), "'y' of type 5");
}

TEST(FromMessage, refusesACountOtherThanOne) {
  PointCloud2 cloud = message(threePoints(), MessageLayout());
  cloud.fields[2].count = 3;
  EXPECT_NAMES(sentence(cloud), "count 3");
}

TEST(FromMessage, refusesTooFewAndTooManyBytes) {
  PointCloud2 cloud = message(threePoints(), MessageLayout());
  cloud.data.pop_back();
  EXPECT_NAMES(sentence(cloud), "holds 47 bytes");
  cloud.data.resize(49);
  EXPECT_NAMES(sentence(cloud), "holds 49 bytes");
}

TEST(FromMessage, refusesOffsetsBeyondThePoint) {
  PointCloud2 cloud = message(threePoints(), MessageLayout());
  cloud.fields[2].offset = 9;
  EXPECT_NAMES(sentence(cloud), "beyond its point_step");
  cloud.fields[2].offset = std::numeric_limits<std::uint32_t>::max();
  EXPECT_NAMES(sentence(cloud), "beyond its point_step");
}

TEST(FromMessage, refusesARowStepBelowItsPoints) {
  PointCloud2 cloud = message(threePoints(), MessageLayout());
  cloud.row_step -= 1;
  EXPECT_NAMES(sentence(cloud), "row_step");
}

TEST(FromMessage, refusesSizesWhoseProductOverflows) {
  PointCloud2 cloud = message(threePoints(), MessageLayout());
  const std::uint32_t huge = 0x80000000U;
  cloud.width = huge;  // times height and point_step: 0 in 32 and in 64 bits
  cloud.height = huge;
  cloud.point_step = 16;
  cloud.row_step = 0;
  EXPECT_NAMES(sentence(cloud), "row_step");
  cloud.point_step = 0;
  cloud.data.clear();
  EXPECT_NAMES(sentence(cloud), "beyond its point_step");
  cloud.point_step = 1;
  cloud.row_step = huge;
  EXPECT_NAMES(sentence(cloud), "bytes");
}

TEST(ToMessage, keepsOrderAndCountWithDroppedPointsAsNan) {
  Eigen::MatrixXd points = threePoints();
  points(0, 1) = kNan;
  const ReceivedCloud source = fromMessage(message(points, MessageLayout()), "cloud");
  const Eigen::RowVector3f depths(0.25F, 0.5F, 0.75F);
  const PointCloud2 written =
      toMessage(source.cloud.points, {{"depth", depths}}, source, std_msgs::Header());
  EXPECT_EQ(written.width * written.height, 4U);
  EXPECT_FALSE(written.is_dense);
  const auto* numbers = reinterpret_cast<const float*>(written.data.data());
  EXPECT_TRUE(std::isnan(numbers[4]) && std::isnan(numbers[7]));
  EXPECT_EQ(numbers[8], source.cloud.points(0, 1));
  EXPECT_EQ(numbers[11], depths[1]);
}

TEST(ToMessage, writesValuesInTheirOrderAndLeavesOutWhatIsNotKnown) {
  const ReceivedCloud source = fromMessage(message(threePoints(), MessageLayout()), "cloud");
  const Eigen::RowVectorXf depths = source.cloud.points.row(2), none;
  const PointCloud2 written =
      toMessage(source.cloud.points, {{"none", none}, {"depth", depths}, {"less", -depths}}, source,
                std_msgs::Header());
  ASSERT_EQ(written.fields.size(), 5U);
  EXPECT_EQ(written.fields[3].name, "depth");
  EXPECT_EQ(written.fields[4].name, "less");
  EXPECT_EQ(written.fields[4].offset, 16U);
  EXPECT_EQ(written.point_step, 20U);
  const auto* numbers = reinterpret_cast<const float*>(written.data.data());
  for (Eigen::Index i = 0; i < depths.size(); ++i) {
    EXPECT_EQ(numbers[5 * i + 3], depths[i]);
    EXPECT_EQ(numbers[5 * i + 4], -depths[i]);
  }
}

TEST(ToMessage, isReadBackUnchanged) {
  const ReceivedCloud source = fromMessage(message(threePoints(), MessageLayout()), "cloud");
  const PointCloud2 written =
      toMessage(source.cloud.points, std::vector<PointValues>(), source, std_msgs::Header());
  EXPECT_EQ(fromMessage(written, "cloud").cloud.points, source.cloud.points);
}

TEST(ToMessage, carriesTheNormalsOfACloudThatHasThem) {
  PointCloud cloud{Points::Random(3, 5), Points::Random(3, 5)};
  cloud.normals.colwise().normalize();
  const PointCloud read = fromMessage(toMessage(cloud, std_msgs::Header()), "cloud").cloud;
  EXPECT_EQ(read.points, cloud.points);
  EXPECT_TRUE(read.normals.isApprox(cloud.normals));
  cloud.normals.resize(3, 0);
  EXPECT_EQ(toMessage(cloud, std_msgs::Header()).fields.size(), 3U);
}

TEST(PoseFromMessage, renormalisesAndRefusesWhatIsNoRotation) {
  geometry_msgs::Pose pose;
  pose.orientation.w = 1.005;
  EXPECT_TRUE(fromMessage(pose, "the guess").isApprox(Eigen::Isometry3d::Identity()));
  pose.orientation.w = 0.0;
  EXPECT_THROW(fromMessage(pose, "the guess"), Refusal);
  pose.orientation.w = 1.0;
  pose.position.y = kNan;
  EXPECT_THROW(fromMessage(pose, "the guess"), Refusal);
}

}  // namespace
}  // namespace unirit
