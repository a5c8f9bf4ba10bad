// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/anatomical_variation.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "shapes.hpp"
#include "unirit/metrics.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

constexpr int kSeeds = 40;

/// Of a closed mesh, by the divergence theorem.
double volume(const Surface& mesh) {
  double sum = 0.0;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) {
      corners.col(k) = mesh.vertices.points.col(mesh.faces(k, f)).cast<double>();
    }
    sum += corners.determinant() / 6.0;
  }
  return sum;
}

TEST(AnatomicalVariation, KeepsVolumeAndExtentPlausible) {
  for (const char* organ : {"liver", "kidney", "gallbladder"}) {
    const Surface original = makePhantom(organ, 1, 1500);
    double smallest = 10.0, largest = 0.0, mean = 0.0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      const Surface varied = varyAnatomy(original, seed);
      const double ratio = volume(varied) / volume(original);
      smallest = std::min(smallest, ratio);
      largest = std::max(largest, ratio);
      mean += ratio / kSeeds;
      const double longer = extent(varied.vertices.points) / extent(original.vertices.points);
      EXPECT_GT(longer, 0.7) << organ << seed;
      EXPECT_LT(longer, 1.4) << organ << seed;
    }
    // Size alone is cut off at exp(-+0.36), 0.70 to 1.43; the warp adds a little
    EXPECT_GT(smallest, 0.6) << organ;
    EXPECT_LT(largest, 1.65) << organ;
    EXPECT_LT(smallest, 0.9) << organ << ": sizes hardly vary";
    EXPECT_GT(largest, 1.1) << organ << ": sizes hardly vary";
    EXPECT_NEAR(mean, 1.0, 0.12) << organ;
  }
}

TEST(AnatomicalVariation, ChangesTheShapeAndNotTheSizeAlone) {
  const Surface original = makePhantom("liver", 2, 1500);
  double sum = 0.0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Surface varied = varyAnatomy(original, seed);
    const Eigen::Matrix3Xd before = original.vertices.points.cast<double>();
    const Eigen::Affine3d fit(
        Eigen::umeyama(before, varied.vertices.points.cast<double>(), true));  // a similarity
    const Points moved = (fit * before).cast<float>();
    sum += rootMeanSquareDistance(moved, varied.vertices.points);
  }
  const double share = sum / kSeeds / extent(original.vertices.points);
  EXPECT_GT(share, 0.008);
  EXPECT_LT(share, 0.04);
}

/// Determinant of the variation's Jacobian, over a grid that holds the organ, by differences: a
/// small tetrahedron at each place, all of them one cloud with the organ's extent and centroid.
TEST(AnatomicalVariation, FoldsSpaceNowhere) {
  constexpr int kSide = 9;
  constexpr float kStep = 0.001F;
  std::vector<Eigen::Vector3f> places;
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    const Eigen::Vector3f cell(static_cast<float>(i % kSide), static_cast<float>(i / kSide % kSide),
                               static_cast<float>(i / kSide / kSide));
    places.push_back((cell / (kSide - 1) - Eigen::Vector3f::Constant(0.5F)) * 0.2F);
  }
  Surface grid;
  grid.vertices.points.resize(3, static_cast<Eigen::Index>(4 * places.size()));
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (int k = 0; k < 4; ++k) {
      Eigen::Vector3f corner = places[i];
      if (k > 0) corner[k - 1] += kStep;
      grid.vertices.points.col(static_cast<Eigen::Index>(4 * i) + k) = corner;
    }
  }
  AnatomicalVariation strong;
  strong.bend = 0.5;  // as strong as it gets: the limit alone holds it
  for (const AnatomicalVariation& variation : {AnatomicalVariation(), strong}) {
    float smallest = 10.0F;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      const Points moved = varyAnatomy(grid, seed, variation).vertices.points;
      for (Eigen::Index i = 0; i < moved.cols(); i += 4) {
        const Eigen::Matrix3f jacobian =
            (moved.middleCols<3>(i + 1).colwise() - moved.col(i)) / kStep;
        smallest = std::min(smallest, jacobian.determinant());
      }
    }
    EXPECT_GT(smallest, 0.05F);
    EXPECT_LT(smallest, 0.95F);
  }
}

TEST(AnatomicalVariation, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const Surface original = makePhantom("kidney", 3, 800);
  const Surface a = varyAnatomy(original, 5);
  EXPECT_EQ(a.vertices.points, varyAnatomy(original, 5).vertices.points);
  EXPECT_NE(a.vertices.points, varyAnatomy(original, 6).vertices.points);
  EXPECT_EQ(a.faces, original.faces);
  EXPECT_EQ(a.vertices.normals.cols(), 0);
}

TEST(AnatomicalVariation, GoesWithTheOrganWhereverItLies) {
  const Surface original = makePhantom("kidney", 3, 800);
  Surface elsewhere = original;
  const Eigen::Vector3f shift(0.5F, -0.25F, 1.0F);
  elsewhere.vertices.points.colwise() += shift;
  const Points moved = varyAnatomy(elsewhere, 7).vertices.points.colwise() - shift;
  EXPECT_LT((moved - varyAnatomy(original, 7).vertices.points).cwiseAbs().maxCoeff(), 1e-5F);
}

TEST(AnatomicalVariation, RefusesWhatItCannotVary) {
  EXPECT_THROW(varyAnatomy(Surface(), 1), std::invalid_argument);
  AnatomicalVariation negative;
  negative.size = -0.1;
  EXPECT_THROW(varyAnatomy(test::box({1, 1, 1}), 1, negative), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
