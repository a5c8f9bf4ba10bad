// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/thin_plate_spline.hpp"

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

#include "unirit/random.hpp"

namespace unirit {
namespace {

constexpr int kFewestCentres = 27;
constexpr int kCandidates = 24;   // per blue-noise centre, the farthest is kept
constexpr double kPadding = 0.1;  // of the bounding box, on every side
constexpr double kLowestDeterminant = 0.1;
constexpr double kFoldedShare = 0.002;
constexpr int kMostDraws = 1000;

/// Blue noise by best candidate (Mitchell 1991) in the padded bounding box.
Eigen::Matrix3Xd blueNoise(const Points& points, Random& random) {
  const Eigen::Vector3d lowest = points.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d highest = points.rowwise().maxCoeff().cast<double>();
  const Eigen::Vector3d margin = kPadding * (highest - lowest);
  const auto count =
      kFewestCentres + random.below(ThinPlateSpline::kMostCentres - kFewestCentres + 1);
  Eigen::Matrix3Xd centres(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    double farthest = -1.0;
    for (int candidate = 0; candidate < kCandidates; ++candidate) {
      const Eigen::Vector3d place = random.uniformVector(lowest - margin, highest + margin);
      const double distance =
          i == 0 ? 0.0 : (centres.leftCols(i).colwise() - place).colwise().squaredNorm().minCoeff();
      if (distance > farthest) {
        farthest = distance;
        centres.col(i) = place;
      }
    }
  }
  return centres;
}

/// Of the rows.
template <class Rows>
Eigen::Array<double, Eigen::Dynamic, 1, 0, ThinPlateSpline::kMostCentres, 1> lengths(
    const Rows& rows) {
  return (rows.col(0).array().square() + rows.col(1).array().square() +
          rows.col(2).array().square())
      .sqrt();
}

}  // namespace

Points ThinPlateSpline::displacements(const Points& points) const {
  Points moved(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d p = points.col(i).cast<double>();
    const Centres offsets = centres_.rowwise() - p.transpose();
    const Eigen::Vector3d displacement = weights_.transpose() * lengths(offsets).matrix() +
                                         affine_.leftCols<3>() * p + affine_.col(3);
    moved.col(i) = displacement.cast<float>();
  }
  return moved;
}

Eigen::RowVectorXf ThinPlateSpline::jacobianDeterminants(const Points& points) const {
  Eigen::RowVectorXf determinants(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    determinants[i] = static_cast<float>(jacobianDeterminant(points.col(i).cast<double>()));
  }
  return determinants;
}

double ThinPlateSpline::jacobianDeterminant(const Eigen::Vector3d& p) const {
  Centres gradients = (-centres_).rowwise() + p.transpose();  // of |p - c|
  gradients.array().colwise() /= lengths(gradients).max(1e-12);
  const Eigen::Matrix3d jacobian =
      Eigen::Matrix3d::Identity() + affine_.leftCols<3>() + weights_.transpose() * gradients;
  return jacobian.determinant();
}

/// Looks no further than it takes to tell.
bool ThinPlateSpline::folds(const Points& points) const {
  const double allowed = kFoldedShare * static_cast<double>(points.cols());
  Eigen::Index folded = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (jacobianDeterminant(points.col(i).cast<double>()) >= kLowestDeterminant) continue;
    if (static_cast<double>(++folded) >= allowed) return true;
  }
  return false;
}

ThinPlateSpline randomDeformation(const Points& points, double rms, std::uint64_t seed) {
  if (points.cols() < 4) throw std::invalid_argument("points: a deformation needs at least 4");
  if (!(rms >= 0.0)) throw std::invalid_argument("rms: must not be negative");
  Random random(seed);
  for (int draw = 0; draw < kMostDraws; ++draw) {
    ThinPlateSpline spline;
    spline.centres_ = blueNoise(points, random).transpose();
    const Eigen::Index count = spline.centres_.rows();
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(count + 4, count + 4);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::RowVector3d centre = spline.centres_.row(i);
      system.row(i).head(count) = lengths(spline.centres_.rowwise() - centre);
      system.row(i).segment<3>(count) = centre;
      system(i, count + 3) = 1.0;
    }
    system.bottomLeftCorner(4, count) = system.topRightCorner(count, 4).transpose();
    Eigen::MatrixXd values = Eigen::MatrixXd::Zero(count + 4, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
      for (int axis = 0; axis < 3; ++axis) values(i, axis) = random.normal();
    }
    const Eigen::MatrixXd solution = system.partialPivLu().solve(values);
    spline.weights_ = solution.topRows(count);
    spline.affine_ = solution.bottomRows(4).transpose();

    const Points drawn = spline.displacements(points);
    const double scale = rms / std::sqrt(drawn.colwise().squaredNorm().cast<double>().mean());
    spline.weights_ *= scale;
    spline.affine_ *= scale;
    if (!spline.folds(points)) return spline;
  }
  throw std::invalid_argument("rms: so strong that every deformation drawn folds");
}

}  // namespace unirit
