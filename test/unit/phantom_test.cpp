// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/phantom.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <stdexcept>

namespace unirit {
namespace {

constexpr int kSeeds = 4;
constexpr int kVertices = 1500;

struct Range {
  double low, high;
};

struct Plausible {
  Range length;  // longest side of the bounding box [mm]
  Range volume;  // [ml]
};

const std::map<std::string, Plausible>& plausible() {
  static const std::map<std::string, Plausible> table{{"gallbladder", {{60, 110}, {12, 80}}},
                                                      {"kidney", {{80, 140}, {80, 300}}},
                                                      {"liver", {{150, 270}, {650, 2500}}},
                                                      {"spleen", {{80, 145}, {70, 350}}},
                                                      {"stomach", {{140, 270}, {400, 1500}}}};
  return table;
}

void forEachPhantom(const std::function<void(const std::string&, const Surface&)>& check) {
  for (const std::string& organ : phantomOrgans()) {
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      SCOPED_TRACE(organ + " " + std::to_string(seed));
      check(organ, makePhantom(organ, seed, kVertices));
    }
  }
}

Eigen::Vector3d corner(const Surface& surface, Eigen::Index face, int k) {
  return surface.vertices.points.col(surface.faces(k, face)).cast<double>();
}

Eigen::Vector3d areaVector(const Surface& surface, Eigen::Index face) {
  const Eigen::Vector3d a = corner(surface, face, 0);
  return 0.5 * (corner(surface, face, 1) - a).cross(corner(surface, face, 2) - a);
}

double volume(const Surface& surface) {
  double sum = 0.0;
  for (Eigen::Index f = 0; f < surface.faces.cols(); ++f) {
    sum += corner(surface, f, 0).dot(areaVector(surface, f)) / 3.0;
  }
  return sum;
}

// RMS distance of the points to the quadric that fits them best, over their extent.
double deviationFromEllipsoid(const Points& points) {
  const Eigen::Matrix3Xd p = points.cast<double>() / extent(points);
  Eigen::MatrixXd terms(p.cols(), 9);
  terms << p.row(0).array().square().matrix().transpose(),
      p.row(1).array().square().matrix().transpose(),
      p.row(2).array().square().matrix().transpose(),
      (p.row(0).array() * p.row(1).array()).matrix().transpose(),
      (p.row(1).array() * p.row(2).array()).matrix().transpose(),
      (p.row(2).array() * p.row(0).array()).matrix().transpose(), p.transpose();
  const Eigen::VectorXd q = terms.colPivHouseholderQr().solve(Eigen::VectorXd::Ones(p.cols()));
  Eigen::Matrix3d gradient;
  gradient << 2 * q[0], q[3], q[5], q[3], 2 * q[1], q[4], q[5], q[4], 2 * q[2];
  const Eigen::ArrayXd value = (terms * q).array() - 1.0;
  const Eigen::ArrayXd slope =
      ((gradient * p).colwise() + q.tail<3>()).colwise().norm().transpose().array();
  return std::sqrt((value / slope).square().mean());
}

TEST(Phantom, EveryOrganIsAClosedOrientedSphereLikeSurface) {
  forEachPhantom([](const std::string&, const Surface& surface) {
    std::set<std::pair<int, int>> edges;
    for (Eigen::Index f = 0; f < surface.faces.cols(); ++f) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_TRUE(edges.emplace(surface.faces(k, f), surface.faces((k + 1) % 3, f)).second);
      }
    }
    for (const auto& [from, to] : edges) EXPECT_EQ(edges.count({to, from}), 1U);
    const auto half_edges = static_cast<Eigen::Index>(edges.size());
    EXPECT_EQ(surface.vertices.size() - half_edges / 2 + surface.faces.cols(), 2);
  });
}

TEST(Phantom, EveryOrganHasAPlausibleSizeAndVolume) {
  ASSERT_EQ(phantomOrgans().size(), plausible().size());
  forEachPhantom([](const std::string& organ, const Surface& surface) {
    const auto& [length, millilitres] = plausible().at(organ);
    const Points& points = surface.vertices.points;
    const double longest =
        1e3 * (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).maxCoeff();
    EXPECT_GT(longest, length.low);
    EXPECT_LT(longest, length.high);
    EXPECT_GT(1e6 * volume(surface), millilitres.low);
    EXPECT_LT(1e6 * volume(surface), millilitres.high);
    EXPECT_LT(centroid(points).norm(), 1e-6F);
  });
}

TEST(Phantom, FacesAreSoundAndNormalsPointOutwards) {
  forEachPhantom([](const std::string&, const Surface& surface) {
    double total = 0.0;
    Eigen::Matrix3Xd sums = Eigen::Matrix3Xd::Zero(3, surface.vertices.size());
    std::vector<double> areas;
    for (Eigen::Index f = 0; f < surface.faces.cols(); ++f) {
      const Eigen::Vector3d area = areaVector(surface, f);
      areas.push_back(area.norm());
      total += area.norm();
      for (int k = 0; k < 3; ++k) sums.col(surface.faces(k, f)) += area;
    }
    const double mean = total / static_cast<double>(areas.size());
    EXPECT_GT(*std::min_element(areas.begin(), areas.end()), 1e-3 * mean);
    ASSERT_EQ(surface.vertices.normals.cols(), surface.vertices.size());
    for (Eigen::Index i = 0; i < sums.cols(); ++i) {
      const Eigen::Vector3d normal = surface.vertices.normals.col(i).cast<double>();
      EXPECT_NEAR(normal.norm(), 1.0, 1e-5);
      EXPECT_GT(normal.dot(sums.col(i).normalized()), 0.5);
    }
  });
}

TEST(Phantom, NoOrganIsAnEllipsoid) {
  const Surface kidney = makePhantom("kidney", 1, kVertices);
  const Points ellipsoid =
      Eigen::Vector3f(0.1F, 0.06F, 0.04F).asDiagonal() * kidney.vertices.normals;
  EXPECT_LT(deviationFromEllipsoid(ellipsoid), 1e-4);
  forEachPhantom([](const std::string&, const Surface& surface) {
    EXPECT_GT(deviationFromEllipsoid(surface.vertices.points), 0.015);
  });
}

TEST(Phantom, HasAboutTheVerticesAskedFor) {
  for (const std::string& organ : phantomOrgans()) {
    for (const int count : {1000, 10000}) {
      const auto made = static_cast<double>(makePhantom(organ, 3, count).vertices.size());
      EXPECT_NEAR(made / count, 1.0, 0.1) << organ;
    }
  }
}

TEST(Phantom, SameSeedGivesTheSamePatientAndAnotherSeedAnother) {
  for (const std::string& organ : phantomOrgans()) {
    const Surface first = makePhantom(organ, 7, kVertices);
    const Surface again = makePhantom(organ, 7, kVertices);
    EXPECT_EQ(first.vertices.points, again.vertices.points);
    EXPECT_EQ(first.faces, again.faces);
    const double difference = volume(makePhantom(organ, 8, kVertices)) / volume(first);
    EXPECT_GT(std::abs(difference - 1.0), 0.001) << organ;
  }
}

TEST(Phantom, RefusesUnknownOrgansAndTooFewVertices) {
  EXPECT_THROW(makePhantom("teapot", 0), std::invalid_argument);
  EXPECT_THROW(makePhantom("", 0), std::invalid_argument);
  EXPECT_THROW(makePhantom("liver", 0, 499), std::invalid_argument);
  EXPECT_THROW(makePhantom("liver", 0, -1), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
