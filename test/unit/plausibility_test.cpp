// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/plausibility.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "shapes.hpp"
#include "unirit/registration.hpp"

namespace unirit {
namespace {

const PlausibilitySettings kDefaults;

bool allPassed(const std::vector<PlausibilityCheck>& checks) {
  return std::all_of(checks.begin(), checks.end(), [](const auto& check) { return check.passed; });
}

std::string faultOf(const Points& points) {
  std::vector<PlausibilityCheck> checks;
  const std::string fault = findFault({points, {}}, "the cloud", kDefaults, checks).value_or("");
  EXPECT_EQ(allPassed(checks), fault.empty()) << fault;
  return fault;
}

/// Of an organ of 0.2 m and what is seen of it, both in other units.
std::string mismatchOf(double seen_scale, double organ_scale = 1.0) {
  const Points points = test::bumpyEllipsoid(200, 1);
  const auto scaled = [&](double scale) {
    return PointCloud{static_cast<float>(scale) * points, {}};
  };
  std::vector<PlausibilityCheck> checks;
  const std::string mismatch =
      findMismatch(scaled(organ_scale), scaled(seen_scale), kDefaults, checks).value_or("");
  EXPECT_EQ(allPassed(checks), mismatch.empty()) << mismatch;
  return mismatch;
}

void expectNames(const std::string& sentence, const std::string& cloud, const std::string& cause) {
  EXPECT_EQ(sentence.rfind("the " + cloud + " cloud's extent", 0), 0U) << sentence;
  EXPECT_NE(sentence.find(cause), std::string::npos) << sentence;
}

/// A registration that passes every check, of an organ of 0.2 m.
Registration plausible() {
  Registration registration;
  registration.status = Status::kSucceeded;
  const Points surface = test::bumpyEllipsoid(100, 2);
  registration.deformation = std::make_shared<const Deformation>(Eigen::Isometry3d::Identity(),
                                                                 surface, Points::Zero(3, 100));
  registration.residual.inlier_fraction = 0.9;
  return registration;
}

/// The same, refined.
Registration plausiblyRefined() {
  Registration registration = plausible();
  RefinementQuality quality;
  quality.surprise = 0.8;
  quality.missing = 0.01;
  quality.confidence = 0.6;
  quality.residual_left = 0.6;
  registration.refinement = quality;
  return registration;
}

std::string refusalOf(Registration registration) {
  applyChecks(checkOutput(registration, Eigen::Isometry3d::Identity(), 0.2, kDefaults),
              registration);
  std::size_t checks = 10;
  if (registration.refinement) checks += registration.refinement->flip_gain ? 6 : 5;
  EXPECT_EQ(registration.checks.size(), checks);
  return registration.succeeded() ? "" : registration.message;
}

std::string refusal(const std::string& check, double value, const std::string& words,
                    double limit) {
  std::ostringstream sentence;
  sentence << "refused: " << check << " is " << value << words << limit;
  return sentence.str();
}

std::string above(const std::string& check, double value, double limit) {
  return refusal(check, value, ", the limit is ", limit);
}

std::string below(const std::string& check, double value, double limit) {
  return refusal(check, value, ", at least ", limit) + " is asked for";
}

TEST(FindFault, AcceptsAnOrgan) { EXPECT_EQ(faultOf(test::bumpyEllipsoid(200, 1)), ""); }

TEST(FindFault, NamesEmptyTinyPlanarCollinearAndRepeatedClouds) {
  const Points organ = test::bumpyEllipsoid(200, 1);
  EXPECT_EQ(faultOf(Points(3, 0)), "the cloud is empty");
  EXPECT_EQ(faultOf(organ.leftCols(10)), "the cloud has 10 valid points, at least 50 are needed");
  Points planar = organ;
  planar.row(1) = 2.0F * planar.row(0) + 0.5F * planar.row(2);
  EXPECT_NE(faultOf(planar).find("planar"), std::string::npos);
  Points collinear = organ;
  collinear.bottomRows(2).setConstant(0.3F);
  EXPECT_NE(faultOf(collinear).find("collinear"), std::string::npos);
}

const char* const kMillimetres = "is it in millimetres, read as metres?";
const char* const kMetres = "is it in metres, read as millimetres?";

TEST(FindMismatch, AcceptsOrgansOfAnySizeAndViewsOfThem) {
  EXPECT_EQ(mismatchOf(1.0), "");
  EXPECT_EQ(mismatchOf(0.4), "");
  EXPECT_EQ(mismatchOf(0.1, 0.1), "");
  EXPECT_EQ(mismatchOf(3.0, 3.0), "");
}

TEST(FindMismatch, BlamesTheCloudThatIsInAnotherUnit) {
  expectNames(mismatchOf(1000.0), "intra-operative", kMillimetres);
  expectNames(mismatchOf(400.0), "intra-operative", kMillimetres);
  expectNames(mismatchOf(0.001), "intra-operative", kMetres);
  expectNames(mismatchOf(1.0, 1000.0), "pre-operative", kMillimetres);
  expectNames(mismatchOf(1.0, 0.001), "pre-operative", kMetres);
}

TEST(FindMismatch, NoticesThatBothAreInAnotherUnit) {
  expectNames(mismatchOf(1000.0, 1000.0), "pre-operative", kMillimetres);
  expectNames(mismatchOf(0.001, 0.001), "pre-operative", kMetres);
}

TEST(FindMismatch, NamesOtherExtentsWithoutAskingForUnits) {
  for (const std::string& sentence : {mismatchOf(5.0), mismatchOf(0.05), mismatchOf(30.0)}) {
    expectNames(sentence, "intra-operative", "times the organ's");
    EXPECT_EQ(sentence.find("read as"), std::string::npos) << sentence;
  }
  const std::string huge = mismatchOf(6.0, 6.0), dot = mismatchOf(0.02, 0.02);
  expectNames(huge, "pre-operative", "is no organ's, outside [0.01, 1] m");
  expectNames(dot, "pre-operative", "is no organ's");
  EXPECT_EQ((huge + dot).find("read as"), std::string::npos);
}

TEST(FindFault, NamesAPointRepeated) {
  std::vector<PlausibilityCheck> checks;
  const auto fault =
      findFault({Points::Constant(3, 100, 1.0F), {}}, "the cloud", kDefaults, checks);
  EXPECT_EQ(fault.value_or(""), "the cloud is a single point, repeated");
}

TEST(CheckOverlap, RefusesCloudsFarFromWhereTheStartHasTheOrgan) {
  const Points organ = test::bumpyEllipsoid(800, 1);
  Points cloud = test::bumpyEllipsoid(400, 2);
  const PlausibilityCheck near = checkOverlap(organ, cloud, 0.2, kDefaults);
  EXPECT_DOUBLE_EQ(near.value, 1.0);
  EXPECT_TRUE(near.passed);
  cloud.leftCols(100).row(0).array() += 0.5F;
  EXPECT_DOUBLE_EQ(checkOverlap(organ, cloud, 0.2, kDefaults).value, 0.75);
  cloud.row(0).array() += 0.5F;
  EXPECT_FALSE(checkOverlap(organ, cloud, 0.2, kDefaults).passed);
}

TEST(CheckOutput, PassesAPlausibleRegistration) {
  EXPECT_EQ(refusalOf(plausible()), "");
  EXPECT_EQ(refusalOf(plausiblyRefined()), "");
}

TEST(CheckOutput, RefusesWhatIsNotFinite) {
  Registration registration = plausible();
  registration.T_intraoperative_preoperative.translation().x() = std::nan("");
  EXPECT_NE(refusalOf(registration).find("not finite"), std::string::npos);
}

TEST(CheckOutput, RefusesRotationsThatAreNone) {
  Registration registration = plausible();
  registration.T_intraoperative_preoperative.linear() *= 1.01;
  EXPECT_NE(refusalOf(registration).find("rotation error"), std::string::npos);
  registration.T_intraoperative_preoperative.linear() = -Eigen::Matrix3d::Identity();
  EXPECT_NE(refusalOf(registration).find("rotation error"), std::string::npos);
}

TEST(CheckOutput, RefusesLargeResiduals) {
  Registration registration = plausible();
  registration.residual.median = 0.02;
  EXPECT_EQ(refusalOf(registration),
            above("median surface residual over extent", 0.1, kDefaults.max_residual));
  registration = plausible();
  registration.residual.p95 = 0.05;
  EXPECT_EQ(refusalOf(registration), above("95th percentile of the surface residual over extent",
                                           0.25, kDefaults.max_residual_p95));
  registration = plausible();
  registration.residual.inlier_fraction = 0.05;
  EXPECT_EQ(refusalOf(registration), below("share of inliers", 0.05, kDefaults.min_inliers));
}

TEST(CheckOutput, RefusesFarTurnsFromTheStart) {
  Registration registration = plausible();
  registration.T_intraoperative_preoperative.rotate(
      Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitY()));
  EXPECT_EQ(refusalOf(registration),
            above("turn from the start [degree]", 90.0, kDefaults.max_turn));
}

TEST(CheckOutput, RefusesImplausibleDeformations) {
  Registration registration = plausible();
  registration.displacement.max = 0.1;
  EXPECT_EQ(refusalOf(registration),
            above("largest displacement over extent", 0.5, kDefaults.max_displacement));
  registration = plausible();
  registration.displacement.stretch = 5.0;
  EXPECT_EQ(refusalOf(registration), above("stretch", 5.0, kDefaults.max_stretch));
  registration = plausible();
  registration.displacement.compression = 0.01;
  EXPECT_EQ(refusalOf(registration), below("compression", 0.01, kDefaults.min_compression));
  registration = plausible();
  registration.displacement.folded_fraction = 0.2;
  EXPECT_EQ(refusalOf(registration), above("share folded over", 0.2, kDefaults.max_folded));
}

TEST(CheckOutput, RefusesWhatTheRefinementShouldNotHaveFound) {
  Registration registration = plausiblyRefined();
  registration.refinement->residual_left = 2.5;
  EXPECT_EQ(refusalOf(registration),
            above("residual over that of the rigid part", 2.5, kDefaults.max_residual_left));
  registration = plausiblyRefined();
  registration.refinement->missing = 0.75;
  EXPECT_EQ(refusalOf(registration),
            above("share in view that is missing", 0.75, kDefaults.max_missing));
  registration = plausiblyRefined();
  registration.refinement->confidence = 0.125;
  EXPECT_EQ(refusalOf(registration), below("mean confidence", 0.125, kDefaults.min_confidence));
  registration = plausiblyRefined();
  registration.refinement->surprise = 2.5;
  EXPECT_EQ(refusalOf(registration),
            above("surprise of the displacement", 2.5, kDefaults.max_surprise));
  registration = plausiblyRefined();
  registration.refinement->flip_gain = -0.5;
  EXPECT_EQ(refusalOf(registration), "");
  registration.refinement->flip_gain = 0.75;
  EXPECT_EQ(refusalOf(registration),
            above("gain in fit of the organ flipped", 0.75, kDefaults.max_flip_gain));
}

TEST(CheckOutput, RefusesWhatIsCloseToAllLimitsAtOnce) {
  Registration registration = plausiblyRefined();
  registration.refinement->surprise = 0.95 * kDefaults.max_surprise;
  EXPECT_EQ(refusalOf(registration), "");  // close to one
  registration.refinement->missing = 0.95 * kDefaults.max_missing;
  registration.refinement->confidence = 1.05 * kDefaults.min_confidence;
  registration.residual.p95 = 0.95 * 0.2 * kDefaults.max_residual_p95;
  EXPECT_EQ(refusalOf(registration).rfind("refused: joint closeness to the limits", 0), 0U);
}

TEST(Closeness, IsAboveOneWhereACheckFails) {
  EXPECT_DOUBLE_EQ(closeness({"at most", 1.0, 2.0, true, false}), 0.5);
  EXPECT_DOUBLE_EQ(closeness({"at most", 4.0, 2.0, false, false}), 2.0);
  EXPECT_DOUBLE_EQ(closeness({"at least", 4.0, 2.0, true, true}), 0.5);
  EXPECT_DOUBLE_EQ(closeness({"at least", 1.0, 2.0, false, true}), 2.0);
  EXPECT_DOUBLE_EQ(closeness({"nothing is asked", 0.0, 0.0, true, true}), 0.0);
}

TEST(CheckJump, MeasuresAtTheOrgansCentroid) {
  const Eigen::Vector3d centre(1.0, 0.0, 0.0);
  // A turn about the centroid shifts the frame's origin far, but not the organ.
  const Eigen::Isometry3d turn = Eigen::Translation3d(centre) *
                                 Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()) *
                                 Eigen::Translation3d(-centre);
  const auto checks = checkJump(turn, Eigen::Isometry3d::Identity(), centre, kDefaults);
  ASSERT_EQ(checks.size(), 2U);
  EXPECT_NEAR(checks[0].value, 0.0, 1e-12);
  EXPECT_NEAR(checks[1].value, 0.5 * 180.0 / M_PI, 1e-9);
  EXPECT_TRUE(checks[0].passed && checks[1].passed);
}

TEST(CheckJump, RefusesFarAndTurnedPoses) {
  const Eigen::Isometry3d far(Eigen::Translation3d(0.2, 0.0, 0.0));
  const Eigen::Isometry3d turned(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitX()));
  const Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  EXPECT_FALSE(checkJump(far, Eigen::Isometry3d::Identity(), centre, kDefaults)[0].passed);
  EXPECT_FALSE(checkJump(turned, Eigen::Isometry3d::Identity(), centre, kDefaults)[1].passed);
}

TEST(ApplyChecks, KeepsTheFirstRefusalsSentenceAndAllChecks) {
  Registration registration = plausible();
  applyChecks({PlausibilityCheck{"one", 1.0, 2.0, true},
               {"two", 3.0, 2.0, false},
               {"three", 4.0, 2.0, false}},
              registration);
  EXPECT_EQ(registration.status, Status::kRefused);
  EXPECT_EQ(registration.message, "refused: two is 3, the limit is 2");
  EXPECT_EQ(registration.checks.size(), 3U);
}

}  // namespace
}  // namespace unirit
