// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/plausibility.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <sstream>

#include "unirit/registration.hpp"

namespace unirit {
namespace {

constexpr double kMillimetresPerMetre = 1000.0;
constexpr double kRotationTolerance = 1e-6;

/// Standard deviations along the principal axes, smallest first.
Eigen::Vector3d principalDeviations(const Points& points) {
  const Eigen::Matrix3Xd centred = (points.colwise() - centroid(points)).cast<double>();
  const Eigen::Matrix3d covariance =
      centred * centred.transpose() / static_cast<double>(points.cols());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
}

std::string sentenceOf(const PlausibilityCheck& check) {
  std::ostringstream sentence;
  sentence << "refused: " << check.name << " is " << check.value << ", the limit is "
           << check.limit;
  return sentence.str();
}

double rotationError(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d rotation = pose.linear();
  const double error = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm();
  return rotation.determinant() > 0.0 ? error : error + 2.0;
}

/// Asks for another unit where that would bring the value between its limits.
const char* unitQuestion(double value, double least, double most) {
  const auto fits = [&](double scale) { return scale * value >= least && scale * value <= most; };
  if (fits(1.0 / kMillimetresPerMetre)) return ": is it in millimetres, read as metres?";
  if (fits(kMillimetresPerMetre)) return ": is it in metres, read as millimetres?";
  return "";
}

PlausibilityCheck atMost(const char* name, double value, double limit) {
  return {name, value, limit, value <= limit};  // false for NaN
}

}  // namespace

std::optional<std::string> findFault(const PointCloud& cloud, const std::string& name,
                                     const PlausibilitySettings& settings) {
  std::ostringstream sentence;
  if (cloud.size() == 0) return name + " is empty";
  if (cloud.size() < settings.min_points) {
    sentence << name << " has " << cloud.size() << " valid points, at least " << settings.min_points
             << " are needed";
    return sentence.str();
  }
  const Eigen::Vector3d deviations = principalDeviations(cloud.points);
  const double least = settings.min_thickness * deviations[2];
  if (deviations[2] <= 0.0) return name + " is a single point, repeated";
  if (deviations[1] < least) return name + " is collinear: its points lie on one line";
  if (deviations[0] < least) return name + " is planar: its points lie in one plane";
  return std::nullopt;
}

std::optional<std::string> findMismatch(const PointCloud& preoperative,
                                        const PointCloud& intraoperative,
                                        const PlausibilitySettings& settings) {
  const double organ = extent(preoperative.points);
  const double least = settings.min_organ_extent, most = settings.max_organ_extent;
  std::ostringstream sentence;
  if (organ < least || organ > most) {
    sentence << "the pre-operative cloud's extent of " << organ << " m is no organ's, outside ["
             << least << ", " << most << "] m" << unitQuestion(organ, least, most);
    return sentence.str();
  }
  const double ratio = extent(intraoperative.points) / organ;
  if (ratio < settings.min_extent_ratio || ratio > settings.max_extent_ratio) {
    sentence << "the intra-operative cloud's extent of " << ratio * organ << " m is " << ratio
             << " times the organ's " << organ << " m, outside [" << settings.min_extent_ratio
             << ", " << settings.max_extent_ratio << "]"
             << unitQuestion(ratio, settings.min_extent_ratio, settings.max_extent_ratio);
    return sentence.str();
  }
  return std::nullopt;
}

std::vector<PlausibilityCheck> checkOutput(const Registration& registration, double organ_extent,
                                           const PlausibilitySettings& settings) {
  const Eigen::Isometry3d& pose = registration.T_intraoperative_preoperative;
  const bool finite = pose.matrix().allFinite() && registration.deformation != nullptr &&
                      registration.deformation->displacements().allFinite();
  std::vector<PlausibilityCheck> checks{
      PlausibilityCheck{"values that are not finite", finite ? 0.0 : 1.0, 0.0, finite},
      atMost("rotation error", rotationError(pose), kRotationTolerance),
      atMost("median surface residual over extent", registration.residual.median / organ_extent,
             settings.max_residual),
      atMost("95th percentile of the surface residual over extent",
             registration.residual.p95 / organ_extent, settings.max_residual_p95),
      atMost("largest displacement over extent", registration.displacement.max / organ_extent,
             settings.max_displacement)};
  if (registration.refinement) {
    checks.push_back(atMost("surprise of the displacement", registration.refinement->surprise,
                            settings.max_surprise));
  }
  return checks;
}

std::vector<PlausibilityCheck> checkJump(const Eigen::Isometry3d& pose,
                                         const Eigen::Isometry3d& accepted,
                                         const Eigen::Vector3d& organ_centroid,
                                         const PlausibilitySettings& settings) {
  const Eigen::AngleAxisd rotation(
      Eigen::Quaterniond(accepted.linear().transpose() * pose.linear()).normalized());
  return {
      atMost("jump in translation [m]", (pose * organ_centroid - accepted * organ_centroid).norm(),
             settings.max_jump_translation),
      atMost("jump in rotation [degree]", std::abs(rotation.angle()) * 180.0 / M_PI,
             settings.max_jump_rotation)};
}

void applyChecks(const std::vector<PlausibilityCheck>& checks, Registration& registration) {
  for (const PlausibilityCheck& check : checks) {
    registration.checks.push_back(check);
    if (check.passed || !registration.succeeded()) continue;
    registration.status = Status::kRefused;
    registration.message = sentenceOf(check);
  }
}

}  // namespace unirit
