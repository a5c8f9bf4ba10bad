// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/screening.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "shapes.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

Surface withoutFaces(const Surface& mesh, Eigen::Index dropped) {
  return {mesh.vertices, mesh.faces.leftCols(mesh.faces.cols() - dropped)};
}

/// Both meshes as one, the second moved away.
Surface together(const Surface& a, const Surface& b) {
  Surface both;
  const Eigen::Index vertices = a.vertices.size();
  both.vertices.points.resize(3, vertices + b.vertices.size());
  both.vertices.points << a.vertices.points, b.vertices.points.array() + 5.0F;
  both.faces.resize(3, a.faces.cols() + b.faces.cols());
  both.faces << a.faces, b.faces.array() + static_cast<int>(vertices);
  return both;
}

/// A phantom cut open by a plane: only the faces on one side of it are left.
Surface half(const Surface& mesh) {
  Surface cut{mesh.vertices, Eigen::Matrix3Xi(3, mesh.faces.cols())};
  Eigen::Index kept = 0;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    if (mesh.vertices.points(2, mesh.faces(0, f)) > 0.0F) cut.faces.col(kept++) = mesh.faces.col(f);
  }
  cut.faces.conservativeResize(Eigen::NoChange, kept);
  return cut;
}

TEST(SurfaceMeasures, OfABoxAreThoseWorkedOutByHand) {
  const Surface box = test::box({0.2F, 0.1F, 0.1F});  // area 0.1, diagonal sqrt(0.06)
  const SurfaceMeasures closed = measureSurface(box);
  EXPECT_EQ(closed.faces, 12);
  EXPECT_NEAR(closed.length, std::sqrt(0.06), 1e-6);
  EXPECT_EQ(closed.open_share, 0.0);
  EXPECT_EQ(closed.main_piece, 1.0);
  // Its last two faces are a side of 0.2 x 0.1 = 0.02 or 0.1 x 0.1 = 0.01 of area
  const Eigen::Vector3i last = box.faces.col(11);
  const double side =
      (box.vertices.points.col(last[1]) - box.vertices.points.col(last[0]))
          .cross(box.vertices.points.col(last[2]) - box.vertices.points.col(last[0]))
          .norm();
  EXPECT_NEAR(measureSurface(withoutFaces(box, 2)).open_share, side / (0.1 - side), 1e-6);
}

TEST(SurfaceMeasures, TellPiecesByTheirShareOfTheArea) {
  // Areas 6 and 6 * 0.25: the larger piece has 0.8 of them
  const Surface two = together(test::box({1, 1, 1}), test::box({0.5F, 0.5F, 0.5F}));
  EXPECT_NEAR(measureSurface(two).main_piece, 0.8, 1e-6);
}

TEST(SurfaceMeasures, AddUpSeveralHoles) {
  const Surface box = test::box({1, 1, 1});
  Surface open{box.vertices, Eigen::Matrix3Xi(3, 10)};
  // Two triangles of 1/2 without a common corner are gone, faces 0 and 2
  open.faces << box.faces.col(1), box.faces.rightCols(9);
  EXPECT_NEAR(measureSurface(open).open_share, 1.0 / 5.0, 1e-6);
}

TEST(Screening, TakesWholePhantomsOfEveryOrgan) {
  for (const std::string& organ : phantomOrgans()) {
    EXPECT_EQ(rejectionReason(makePhantom(organ, 1, 1000), organ, {}), "") << organ;
  }
}

TEST(Screening, SaysWhyASurfaceIsRejected) {
  const Surface liver = makePhantom("liver", 1, 1000);
  const auto expectReason = [](const Surface& surface, const char* organ, const char* words,
                               const ScreeningLimits& limits = {}) {
    const std::string reason = rejectionReason(surface, organ, limits);
    EXPECT_NE(reason.find(words), std::string::npos) << reason;
  };
  expectReason(test::box({0.2F, 0.2F, 0.2F}), "liver", "has 12 faces, fewer than 400");
  expectReason(half(liver), "liver", "is open: its holes have");
  expectReason(liver, "gallbladder", "not plausible for gallbladder (30 to 180 mm)");
  Surface metres = liver;
  metres.vertices.points *= 1000.0F;  // millimetres taken for metres
  expectReason(metres, "liver", "not plausible for liver");
  expectReason(metres, "something_else", "not plausible for something_else (10 to 1000 mm)");
  Surface pieces = liver;
  for (int i = 0; i < 4; ++i) pieces = together(pieces, liver);
  expectReason(pieces, "liver", "is in pieces: the largest has 20 %");
  expectReason({liver.vertices, {}}, "liver", "has 0 faces");
  expectReason({{Points::Zero(3, liver.vertices.size()), {}}, liver.faces}, "liver",
               "has no face with an area");
}

TEST(Screening, GoesByTheLimitsGiven) {
  const Surface liver = makePhantom("liver", 1, 1000);
  ScreeningLimits limits;
  limits.lengths["liver"] = {0.01, 0.02};
  EXPECT_NE(rejectionReason(liver, "liver", limits), "");
  limits = {};
  limits.max_open_share = 1.0;
  EXPECT_EQ(rejectionReason(half(liver), "liver", limits), "");
  limits.min_faces = 100000;
  EXPECT_NE(rejectionReason(liver, "liver", limits), "");
}

}  // namespace
}  // namespace unirit
