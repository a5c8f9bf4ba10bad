// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/preprocessing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <tuple>

#include "shapes.hpp"
#include "unirit/metrics.hpp"

namespace unirit {
namespace {

using test::bumpyEllipsoid;
using test::shuffled;

/// Everything off.
RegistrationSettings settings() {
  RegistrationSettings settings;
  settings.preprocessing = {0.0, 0.0, 0.0};
  settings.sampling.points = 256;
  return settings;
}

const Points& organ() {
  static const Points points = bumpyEllipsoid(3000, 1);
  return points;
}

RawCloud raw(const Points& points) {
  RawCloud raw{{points, {}}};
  raw.received = points.cols();
  return raw;
}

/// Points left after each stage, by its name.
std::map<std::string, Eigen::Index> counts(const Preprocessed& result) {
  std::map<std::string, Eigen::Index> counts;
  for (const StagePoints& stage : result.stages) counts[stage.stage] = stage.points;
  return counts;
}

std::vector<std::string> names(const Preprocessed& result) {
  std::vector<std::string> names;
  for (const StagePoints& stage : result.stages) names.push_back(stage.stage);
  return names;
}

Points joined(const Points& a, const Points& b) {
  Points points(3, a.cols() + b.cols());
  points << a, b;
  return points;
}

/// A sheet of points, 2 cm wide, around the place.
Points sheetAt(const Eigen::Vector3f& place, Eigen::Index count) {
  return (0.1F * bumpyEllipsoid(count, 7)).colwise() + place;
}

/// A curtain of flying pixels: every few millimetres one, away from the organ.
Points flyingPixels(Eigen::Index count) {
  Random random(3);
  return Points::NullaryExpr(3, count, [&](Eigen::Index axis, Eigen::Index) {
    return static_cast<float>(axis == 2 ? random.uniform(0.10, 0.16) : random.uniform(-0.1, 0.1));
  });
}

TEST(Preprocessing, withEverythingOffChangesNothingAndCountsWhatCame) {
  RawCloud cloud = raw(organ());
  cloud.received += 7;
  const Preprocessed result = preprocess(cloud, organ(), settings());
  EXPECT_EQ(result.cloud.points, organ());
  EXPECT_EQ(names(result), (std::vector<std::string>{"received", "valid"}));
  EXPECT_EQ(counts(result)["received"], organ().cols() + 7);
  EXPECT_EQ(counts(result)["valid"], organ().cols());
  EXPECT_FALSE(result.fault);
}

TEST(Preprocessing, namesItsStagesInTheirOrder) {
  RawCloud cloud = raw(organ());
  cloud.region = Region{{Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)},
                        Eigen::Isometry3d::Identity()};
  cloud.T_cloud_organ = Eigen::Isometry3d::Identity();
  RegistrationSettings all = settings();
  all.preprocessing = {0.5, 0.01, 0.05};
  EXPECT_EQ(
      names(preprocess(cloud, organ(), all)),
      (std::vector<std::string>{"received", "valid", "region", "margin", "outliers", "voxel"}));
}

TEST(Preprocessing, dropsPointsAtTheViewpointWhereThereIsOne) {
  RawCloud cloud = raw(joined(organ(), Points::Zero(3, 40)));
  EXPECT_EQ(preprocess(cloud, organ(), settings()).cloud.size(), organ().cols() + 40);
  cloud.cloud.viewpoint = Eigen::Vector3f::Zero();
  const Preprocessed result = preprocess(cloud, organ(), settings());
  EXPECT_EQ(result.cloud.points, organ());
  EXPECT_EQ(counts(result)["received"], organ().cols() + 40);
  EXPECT_EQ(counts(result)["valid"], organ().cols());
  EXPECT_EQ(result.cloud.viewpoint, cloud.cloud.viewpoint);
}

TEST(Preprocessing, cropsToARegionInAFrameOfItsOwn) {
  RawCloud cloud = raw(organ());
  const Eigen::Isometry3d T_box_cloud = Eigen::Translation3d(0.3, -0.2, 0.1) *
                                        Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ());
  cloud.region =
      Region{{Eigen::Vector3d(0.3, -1.0, -1.0), Eigen::Vector3d(1.0, 1.0, 1.0)}, T_box_cloud};
  const Preprocessed result = preprocess(cloud, organ(), settings());
  // x of the box is -y of the cloud: what is left has no y above zero
  EXPECT_EQ(result.cloud.size(), (organ().row(1).array() <= 0.0F).count());
  EXPECT_LE(result.cloud.points.row(1).maxCoeff(), 1e-6F);
  EXPECT_LT(result.cloud.size(), organ().cols());
  EXPECT_GT(result.cloud.size(), 1000);
}

TEST(Preprocessing, normalsStayWithTheirPoints) {
  RawCloud cloud = raw(organ());
  cloud.cloud.normals = organ().colwise().normalized();
  cloud.region =
      Region{{Eigen::Vector3d(0, -1, -1), Eigen::Vector3d(1, 1, 1)}, Eigen::Isometry3d::Identity()};
  RegistrationSettings all = settings();
  all.preprocessing = {0.0, 0.02, 0.05};
  const Preprocessed result = preprocess(cloud, organ(), all);
  ASSERT_LT(result.cloud.size(), organ().cols() / 2);
  ASSERT_EQ(result.cloud.normals.cols(), result.cloud.size());
  EXPECT_EQ(result.cloud.normals, result.cloud.points.colwise().normalized());
}

TEST(Preprocessing, keepsWhatIsNearToWhereTheOrganIsExpected) {
  const Eigen::Isometry3d T_cloud_organ =
      Eigen::Translation3d(0.5, 0.0, 1.0) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX());
  const Points seen = moved(T_cloud_organ, organ());
  const Eigen::Vector3f near = (T_cloud_organ * Eigen::Vector3d(0.0, 0.0, 0.08)).cast<float>();
  const Eigen::Vector3f far = (T_cloud_organ * Eigen::Vector3d(0.0, 0.0, 0.30)).cast<float>();
  RawCloud cloud = raw(joined(seen, joined(sheetAt(near, 200), sheetAt(far, 300))));
  RegistrationSettings around = settings();
  around.preprocessing.margin = 0.5;
  EXPECT_EQ(preprocess(cloud, organ(), around).cloud.size(), cloud.cloud.size())
      << "without a place where the organ is expected nothing is cropped";
  cloud.T_cloud_organ = T_cloud_organ;
  const Preprocessed result = preprocess(cloud, organ(), around);
  EXPECT_EQ(result.cloud.points, joined(seen, sheetAt(near, 200)));
  EXPECT_EQ(counts(result)["margin"], seen.cols() + 200);
  EXPECT_FALSE(result.fault);
}

TEST(Preprocessing, aCropThatLeavesTooLittleIsAFaultThatNamesItsParameter) {
  RawCloud cloud = raw(organ());
  cloud.region =
      Region{{Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(2, 2, 2)}, Eigen::Isometry3d::Identity()};
  Preprocessed result = preprocess(cloud, organ(), settings());
  ASSERT_TRUE(result.fault);
  EXPECT_EQ(
      *result.fault,
      "preprocessing/region leaves 0 of 3000 points of the intra-operative cloud, at least 50 "
      "are needed");
  EXPECT_EQ(counts(result)["region"], 0);

  cloud.region.reset();
  cloud.T_cloud_organ = Eigen::Isometry3d(Eigen::Translation3d(1.0, 0.0, 0.0));
  RegistrationSettings around = settings();
  around.preprocessing.margin = 0.5;
  result = preprocess(cloud, organ(), around);
  ASSERT_TRUE(result.fault);
  EXPECT_EQ(result.fault->rfind("preprocessing/margin leaves 0 of 3000", 0), 0U) << *result.fault;
}

TEST(Preprocessing, aCloudThatWasTooSmallBeforeIsLeftToTheRegistrar) {
  RawCloud cloud = raw(organ().leftCols(20));
  cloud.region =
      Region{{Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(2, 2, 2)}, Eigen::Isometry3d::Identity()};
  EXPECT_FALSE(preprocess(cloud, organ(), settings()).fault);
}

TEST(Preprocessing, keepsOnePointOfEachVoxelAndCoversTheSurface) {
  const Points dense = bumpyEllipsoid(60000, 2);
  RegistrationSettings thinned = settings();
  thinned.preprocessing.voxel = 0.02;
  const double edge = 0.02 * extent(organ());
  const Points& left = preprocess(raw(dense), organ(), thinned).cloud.points;
  EXPECT_GT(left.cols(), 256);
  EXPECT_LT(left.cols(), 10000);
  const Eigen::Matrix3Xi cells = (left.cast<double>() / edge).array().floor().cast<int>();
  std::set<std::tuple<int, int, int>> seen;
  for (Eigen::Index i = 0; i < cells.cols(); ++i) {
    seen.emplace(cells(0, i), cells(1, i), cells(2, i));
  }
  EXPECT_EQ(static_cast<Eigen::Index>(seen.size()), left.cols());
  EXPECT_EQ(nearestDistances(left, dense).maxCoeff(), 0.0F) << "points of the cloud, not means";
  EXPECT_LT(nearestDistances(dense, left).maxCoeff(), std::sqrt(3.0) * edge);
}

TEST(Preprocessing, givesTheSameCloudWhateverTheOrderOfThePoints) {
  const Points dense = joined(bumpyEllipsoid(60000, 2), flyingPixels(300));
  RegistrationSettings usual;
  const Preprocessed one = preprocess(raw(dense), organ(), usual);
  const Preprocessed other = preprocess(raw(shuffled(dense, 5)), organ(), usual);
  EXPECT_LT(one.cloud.size(), 20000);
  EXPECT_EQ(one.cloud.points, other.cloud.points);
  EXPECT_EQ(counts(one), counts(other));
}

TEST(Preprocessing, leavesFlyingPixelsOutAndTheOrganIn) {
  const Points dense = bumpyEllipsoid(60000, 2);
  const Points cloud = joined(dense, flyingPixels(300));
  RegistrationSettings usual;
  const Preprocessed result = preprocess(raw(cloud), organ(), usual);
  EXPECT_LT(result.cloud.points.row(2).maxCoeff(), 0.09F);
  EXPECT_GE(counts(result)["outliers"], 59900);
  EXPECT_LE(counts(result)["outliers"], 60000);
  EXPECT_LT(nearestDistances(dense, result.cloud.points).maxCoeff(), 0.01F);
  usual.preprocessing.min_density = 0.0;
  const Preprocessed kept = preprocess(raw(cloud), organ(), usual);
  EXPECT_GT(kept.cloud.points.row(2).maxCoeff(), 0.15F) << "off, they stay";
  EXPECT_EQ(counts(kept).count("outliers"), 0U);
}

TEST(Preprocessing, takesASmallOrSparseCloudWhole) {
  const RegistrationSettings usual;
  for (const Eigen::Index count : {60, 1000, 1024}) {
    const Points sparse = bumpyEllipsoid(count, 4);
    EXPECT_EQ(preprocess(raw(sparse), organ(), usual).cloud.points, sparse);
  }
}

TEST(Preprocessing, halvesTheVoxelsOfASmallViewUntilEnoughIsLeft) {
  const Points view = sheetAt({0.0F, 0.0F, 0.5F}, 60000);  // a tenth of the organ's extent
  const RegistrationSettings usual;
  const Preprocessed result = preprocess(raw(view), organ(), usual);
  EXPECT_GE(result.cloud.size(), usual.sampling.points);
  EXPECT_LT(result.cloud.size(), 8 * usual.sampling.points);
}

TEST(Preprocessing, copesWithRepeatedPointsAndFarOnes) {
  const RegistrationSettings usual;
  for (const float place : {0.0F, 0.5F, 1e30F}) {
    const Points same = Points::Constant(3, 5000, place);
    EXPECT_EQ(preprocess(raw(same), organ(), usual).cloud.points, same) << place;
  }
  Points far = bumpyEllipsoid(5000, 2);
  far(0, 0) = 1e30F;
  EXPECT_EQ(preprocess(raw(far), organ(), usual).cloud.points, far);
}

TEST(Preprocessing, keepsEveryPointThatIsOneOfTheOrgans) {
  RegistrationSettings matched;
  matched.refinement.correspondence = Correspondence::kPoints;
  const Points tracked = joined(bumpyEllipsoid(60000, 2), flyingPixels(300));
  const Preprocessed result = preprocess(raw(tracked), organ(), matched);
  EXPECT_EQ(result.cloud.points, tracked);
  EXPECT_EQ(names(result), (std::vector<std::string>{"received", "valid"}));
}

TEST(Preprocessing, leavesCloudsThatCannotBeRegisteredToTheRegistrar) {
  RegistrationSettings usual;
  usual.preprocessing.margin = 0.5;
  RawCloud cloud = raw(organ());
  cloud.T_cloud_organ = Eigen::Isometry3d::Identity();
  const Points none(3, 0);
  EXPECT_EQ(preprocess(cloud, none, usual).cloud.points, organ());
  EXPECT_EQ(preprocess(cloud, 1000.0F * organ(), usual).cloud.points, organ());
  cloud.cloud.points = none;
  const Preprocessed empty = preprocess(cloud, organ(), usual);
  EXPECT_EQ(empty.cloud.size(), 0);
  EXPECT_FALSE(empty.fault);
}

TEST(Preprocessing, refusesSettingsOutOfRange) {
  RegistrationSettings wrong = settings();
  wrong.preprocessing.voxel = -0.01;
  EXPECT_THROW(preprocess(raw(organ()), organ(), wrong), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
