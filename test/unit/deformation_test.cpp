// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/deformation.hpp"

#include <gtest/gtest.h>

#include "shapes.hpp"

namespace unirit {
namespace {

Eigen::Isometry3d somePose() {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.translation() << 0.5, -0.2, 0.1;
  return pose;
}

TEST(Deformation, MovesSurfacePointsByTheirOwnDisplacement) {
  const Points surface = test::bumpyEllipsoid(200, 1);
  const Points displacements = 0.01F * Points::Random(3, 200);
  const Deformation deformation(somePose(), surface, displacements);
  const Points expected = (somePose().cast<float>() * surface) + displacements;
  EXPECT_TRUE(deformation.movedSurface().isApprox(expected, 1e-6F));
  EXPECT_TRUE(deformation.move(surface).isApprox(expected, 1e-6F));
}

TEST(Deformation, MovesInnerPointsByTheMeanOfTheirNeighbours) {
  const Points surface = test::bumpyEllipsoid(500, 2);
  const Points same = Eigen::Vector3f(0.01F, 0.02F, 0.03F).replicate(1, 500);
  const Deformation deformation(Eigen::Isometry3d::Identity(), surface, same);
  const Points inner = 0.5F * surface.leftCols(20);
  EXPECT_TRUE(deformation.move(inner).isApprox(inner + same.leftCols(20), 1e-5F));
}

TEST(Deformation, WeighsNeighboursByInverseDistance) {
  Points surface(3, 2), displacements = Points::Zero(3, 2);
  surface << 0, 4, 0, 0, 0, 0;
  displacements(2, 0) = 3.0F;
  const Deformation deformation(Eigen::Isometry3d::Identity(), surface, displacements);
  const Points moved = deformation.move(Eigen::Vector3f(1, 0, 0));
  EXPECT_NEAR(moved(2, 0), 3.0F * (1.0F / 1.0F) / (1.0F / 1.0F + 1.0F / 3.0F), 1e-6F);
}

TEST(Deformation, RigidPartLeavesDisplacementsOut) {
  const Points surface = test::bumpyEllipsoid(50, 3);
  const Deformation deformation(somePose(), surface, Points::Ones(3, 50));
  EXPECT_TRUE(deformation.moveRigidly(surface).isApprox(somePose().cast<float>() * surface, 1e-6F));
}

TEST(Deformation, TellsHowTheSurfaceIsStretchedAndTurned) {
  const Points surface = test::bumpyEllipsoid(800, 4);
  Points displacements = Points::Zero(3, 800);
  displacements.row(0) = 0.5F * surface.row(0);  // in the intra-operative frame
  const auto pose = somePose();
  const auto meanDeterminant = [&](float share) {
    const Points squeezed = pose.linear().cast<float>() * (share * displacements);
    double sum = 0.0;
    for (const auto& jacobian : Deformation(pose, surface, squeezed).jacobians(surface)) {
      sum += jacobian.determinant();
    }
    return sum / 800.0;
  };
  EXPECT_NEAR(meanDeterminant(0.0F), 1.0, 1e-5);
  EXPECT_NEAR(meanDeterminant(1.0F), 1.5, 0.02);
  EXPECT_NEAR(meanDeterminant(-1.0F), 0.5, 0.02);
  EXPECT_LT(meanDeterminant(-4.0F), 0.0);  // mirrored
}

/// Moves every point alike, and is half sure of it.
class Shift : public DisplacementField {
 public:
  Points displacements(const Points& preoperative) const override {
    return Eigen::Vector3f(0.01F, 0.0F, 0.0F).replicate(1, preoperative.cols());
  }
  std::vector<Eigen::Matrix3f> gradients(const Points& preoperative) const override {
    return std::vector<Eigen::Matrix3f>(static_cast<std::size_t>(preoperative.cols()),
                                        Eigen::Matrix3f::Zero());
  }
  Eigen::RowVectorXf confidence(const Points& preoperative) const override {
    return Eigen::RowVectorXf::Constant(preoperative.cols(), 0.5F);
  }
  float priorDeviation() const override { return 0.01F; }
};

TEST(Deformation, TakesWhatTheFieldSaysOfTheSurfaceAndAsksItOfOtherPoints) {
  const auto field = std::make_shared<const Shift>();
  const Points surface = test::bumpyEllipsoid(30, 5), others = test::bumpyEllipsoid(7, 6);
  const Eigen::RowVectorXf sure = Eigen::RowVectorXf::LinSpaced(30, 0.0F, 1.0F);
  const Deformation deformation(somePose(), surface, field, {Points::Constant(3, 30, 0.02F), sure});
  const Points rigid = deformation.moveRigidly(surface);
  EXPECT_TRUE(deformation.movedSurface().isApprox((rigid.array() + 0.02F).matrix(), 1e-6F));
  EXPECT_EQ(deformation.confidence(), sure);
  EXPECT_FLOAT_EQ(deformation.deviations()[0], 0.01F) << "nothing was learnt";
  EXPECT_EQ(deformation.deviations()[29], 0.0F) << "nothing is left";
  const Points shift = deformation.move(others) - deformation.moveRigidly(others);
  EXPECT_TRUE(shift.isApprox(field->displacements(others), 1e-4F));
  EXPECT_EQ(deformation.confidence(others), field->confidence(others));
}

TEST(Deformation, RefusesNoFieldAndValuesOfAnotherNumberOfPoints) {
  const auto pose = Eigen::Isometry3d::Identity();
  const Points surface = test::bumpyEllipsoid(30, 5);
  const Points displacements = Points::Zero(3, 30);
  EXPECT_THROW(Deformation(pose, surface, nullptr, {displacements, {}}), std::invalid_argument);
  const auto field = std::make_shared<const Shift>();
  EXPECT_THROW(Deformation(pose, surface, field, {displacements.leftCols(29), {}}),
               std::invalid_argument);
  EXPECT_THROW(Deformation(pose, surface, field, {displacements, Eigen::RowVectorXf::Ones(29)}),
               std::invalid_argument);
}

TEST(Deformation, RefusesDisplacementsOfAnotherSizeAndEmptySurfaces) {
  const auto pose = Eigen::Isometry3d::Identity();
  EXPECT_THROW(Deformation(pose, Points(3, 2), Points(3, 3)), std::invalid_argument);
  EXPECT_THROW(Deformation(pose, Points(3, 0), Points(3, 0)), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
