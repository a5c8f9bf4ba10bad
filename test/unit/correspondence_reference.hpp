// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "refinement/correspondence.hpp"

/// The correspondences as correspondence.hpp describes them, pair by pair in double precision: what
/// the fast ones are held against.
namespace unirit::reference {

constexpr double kSourceOutliers = 0.1;  // of correspondence.cpp, as the next two
constexpr double kFlatVariance = 1e-4;
constexpr double kReach = 4.0;

struct Expected {
  Eigen::RowVectorXd mass;
  Eigen::Matrix3Xd positions;
  Eigen::Matrix3Xd normals;
  double fit;
};

/// Affinities, N x M, of pairs within `reach`; `signs`: of the normals' cosines.
inline Eigen::MatrixXd affinities(const PointCloud& source, const PointCloud& target,
                                  const Attraction& attraction, double reach,
                                  Eigen::MatrixXd& signs) {
  const auto sigma = static_cast<double>(attraction.sigma);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(source.size(), target.size());
  signs = Eigen::MatrixXd::Ones(source.size(), target.size());
  for (Eigen::Index i = 0; i < source.size(); ++i) {
    for (Eigen::Index j = 0; j < target.size(); ++j) {
      const Eigen::Vector3d offset =
          target.points.col(j).cast<double>() - source.points.col(i).cast<double>();
      if (offset.norm() > reach) continue;
      result(i, j) = std::exp(-offset.squaredNorm() / (2.0 * sigma * sigma));
      if (attraction.normals == NormalUse::kNone) continue;
      const double cosine =
          source.normals.col(i).cast<double>().dot(target.normals.col(j).cast<double>());
      signs(i, j) = cosine < 0.0 ? -1.0 : 1.0;
      const bool other_side = attraction.normals == NormalUse::kSigned && cosine < 0.0;
      result(i, j) *= other_side ? 0.0 : cosine * cosine;
    }
  }
  return result;
}

/// Outliers fill a box with the target's principal variances: their density in the affinities'
/// unit, for each point of the other cloud.
inline double background(const PointCloud& target, const Attraction& attraction) {
  const Eigen::Matrix3Xd points = target.points.cast<double>();
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Matrix3d covariance =
      centred * centred.transpose() / static_cast<double>(target.size()) +
      kFlatVariance * Eigen::Matrix3d::Identity();
  const double volume = std::sqrt(std::pow(12.0, 3) * covariance.determinant());
  const auto share = static_cast<double>(attraction.outlier_share);
  const auto sigma = static_cast<double>(attraction.sigma);
  return share / (1.0 - share) * std::pow(2.0 * M_PI * sigma * sigma, 1.5) / volume;
}

/// N x M responsibilities: each target point's over the source and each source point's over the
/// target, mixed. `sums` normalises; it differs from `affinity` only in bounds.
inline Eigen::MatrixXd responsibilities(const Eigen::MatrixXd& affinity,
                                        const Eigen::MatrixXd& sums, double background,
                                        const Eigen::RowVectorXf& visibility,
                                        const Attraction& attraction) {
  const double target_share = 1.0 / (1.0 + static_cast<double>(attraction.symmetry));
  const Eigen::RowVectorXd of_targets =
      sums.colwise().sum().array() + background * static_cast<double>(affinity.rows());
  const Eigen::VectorXd of_sources =
      sums.rowwise().sum().array() +
      kSourceOutliers * background * static_cast<double>(affinity.cols());
  const Eigen::VectorXd seen = visibility.transpose().cast<double>();
  const Eigen::ArrayXXd by_target = affinity.array().rowwise() / of_targets.array();
  const Eigen::ArrayXXd by_source =
      affinity.array().colwise() * (seen.array() / of_sources.array());
  return target_share * by_target + (1.0 - target_share) * by_source;
}

/// Mean log likelihood of the target points and of the visible source points, up to constants.
inline double fit(const Eigen::MatrixXd& affinity, double background,
                  const Eigen::RowVectorXf& visibility) {
  const auto source_count = static_cast<double>(affinity.rows()),
             target_count = static_cast<double>(affinity.cols());
  const double target = (affinity.colwise().sum().array() + background * source_count).log().mean();
  const Eigen::ArrayXd source =
      (affinity.rowwise().sum().array() + kSourceOutliers * background * target_count).log();
  const Eigen::ArrayXd seen = visibility.transpose().cast<double>();
  return target + (seen * source).sum() / std::max(seen.sum(), 1.0);
}

inline Expected correspondences(const PointCloud& source, const PointCloud& target,
                                const Eigen::RowVectorXf& visibility, const Attraction& attraction,
                                double reach = std::numeric_limits<double>::infinity()) {
  Eigen::MatrixXd signs;
  const Eigen::MatrixXd affinity = affinities(source, target, attraction, reach, signs);
  const Eigen::MatrixXd weights =
      responsibilities(affinity, affinity, background(target, attraction), visibility, attraction);
  Expected expected{weights.rowwise().sum().transpose(), source.points.cast<double>(),
                    Eigen::Matrix3Xd::Zero(3, source.size()),
                    fit(affinity, background(target, attraction), visibility)};
  for (Eigen::Index i = 0; i < source.size(); ++i) {
    if (expected.mass[i] <= 0.0) continue;
    const Eigen::VectorXd row = weights.row(i).transpose();
    expected.positions.col(i) = target.points.cast<double>() * row / expected.mass[i];
    const Eigen::VectorXd turned = row.cwiseProduct(signs.row(i).transpose());
    expected.normals.col(i) = (target.normals.cast<double>() * turned).stableNormalized();
  }
  return expected;
}

}  // namespace unirit::reference
