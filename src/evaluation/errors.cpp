// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/errors.hpp"

#include <cmath>
#include <stdexcept>

#include "unirit/metrics.hpp"

namespace unirit {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

double meanSquare(const Eigen::RowVectorXf& distances) {
  return distances.cast<double>().squaredNorm() / static_cast<double>(distances.size());
}

void addChamfer(const Points& source, const Points& target, RegistrationErrors& errors) {
  const Eigen::RowVectorXf there = nearestDistances(source, target);
  const Eigen::RowVectorXf back = nearestDistances(target, source);
  errors.chamfer = (there.cast<double>().mean() + back.cast<double>().mean()) / 2.0;
  errors.chamfer_squared = meanSquare(there) + meanSquare(back);
}

void addPose(const RegistrationPair& pair, const Eigen::Isometry3d& pose,
             RegistrationErrors& errors) {
  const Eigen::Matrix3d turn = pair.best_rigid.linear().transpose() * pose.linear();
  const Eigen::Vector3d centre = centroid(pair.source).cast<double>();
  errors.rotation = kDegrees * Eigen::AngleAxisd(turn).angle();
  errors.translation = (pose * centre - pair.best_rigid * centre).norm();
  errors.pose =
      rootMeanSquareDistance(moved(pose, pair.source), moved(pair.best_rigid, pair.source));
}

}  // namespace

RegistrationErrors registrationErrors(const RegistrationPair& pair, const MethodResult& result) {
  if (result.interior.cols() != pair.interior.cols()) {
    throw std::invalid_argument("result: must hold as many interior points as the pair");
  }
  RegistrationErrors errors;
  errors.refused = result.refused;
  errors.before = rootMeanSquareDistance(pair.source, pair.truth);
  errors.best_rigid = rootMeanSquareDistance(moved(pair.best_rigid, pair.source), pair.truth);
  errors.rmse = rootMeanSquareDistance(result.source, pair.truth);
  const Eigen::RowVectorXf distances = (result.source - pair.truth).colwise().norm();
  errors.p95 = quantile({distances.data(), distances.data() + distances.size()}, 0.95);
  addChamfer(result.source, pair.target, errors);
  if (pair.surface.cols() > 0) {
    errors.surface = std::sqrt(meanSquare(nearestDistances(result.source, pair.surface)));
  }
  if (pair.interior.cols() > 0) {
    errors.target = rootMeanSquareDistance(result.interior, pair.interior_truth);
  }
  if (result.pose) addPose(pair, *result.pose, errors);
  return errors;
}

}  // namespace unirit
