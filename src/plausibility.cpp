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
constexpr double kOverlapReach = 0.1;  // over the organ's extent

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
  sentence << "refused: " << check.name << " is " << check.value
           << (check.at_least ? ", at least " : ", the limit is ") << check.limit
           << (check.at_least ? " is asked for" : "");
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

PlausibilityCheck atMost(const std::string& name, double value, double limit) {
  return {name, value, limit, value <= limit};  // false for NaN
}

PlausibilityCheck atLeast(const std::string& name, double value, double limit) {
  return {name, value, limit, value >= limit, true};
}

double degreesBetween(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::AngleAxisd rotation(
      Eigen::Quaterniond(a.linear().transpose() * b.linear()).normalized());
  return std::abs(rotation.angle()) * 180.0 / M_PI;
}

/// One near all of its limits is less believable than one near a single limit.
PlausibilityCheck jointly(const std::vector<PlausibilityCheck>& checks, double limit) {
  double sum = 0.0;
  for (const PlausibilityCheck& check : checks) sum += closeness(check) * closeness(check);
  return atMost("joint closeness to the limits",
                std::sqrt(sum / static_cast<double>(checks.size())), limit);
}

}  // namespace

double closeness(const PlausibilityCheck& check) {
  const double least = check.at_least ? check.limit : check.value;
  const double most = check.at_least ? check.value : check.limit;
  return least <= 0.0 ? 0.0 : least / most;
}

std::optional<std::string> findFault(const PointCloud& cloud, const std::string& name,
                                     const PlausibilitySettings& settings,
                                     std::vector<PlausibilityCheck>& checks) {
  checks.push_back(
      atLeast("points of " + name, static_cast<double>(cloud.size()), settings.min_points));
  std::ostringstream sentence;
  if (cloud.size() == 0) return name + " is empty";
  if (cloud.size() < settings.min_points) {
    sentence << name << " has " << cloud.size() << " valid points, at least " << settings.min_points
             << " are needed";
    return sentence.str();
  }
  const Eigen::Vector3d deviations = principalDeviations(cloud.points);
  if (deviations[2] <= 0.0) return name + " is a single point, repeated";
  checks.push_back(atLeast("thickness over length of " + name, deviations[0] / deviations[2],
                           settings.min_thickness));
  const double least = settings.min_thickness * deviations[2];
  if (deviations[1] < least) return name + " is collinear: its points lie on one line";
  if (deviations[0] < least) return name + " is planar: its points lie in one plane";
  return std::nullopt;
}

std::optional<std::string> findMismatch(const PointCloud& preoperative,
                                        const PointCloud& intraoperative,
                                        const PlausibilitySettings& settings,
                                        std::vector<PlausibilityCheck>& checks) {
  const double organ = extent(preoperative.points);
  const double least = settings.min_organ_extent, most = settings.max_organ_extent;
  checks.push_back(atLeast("smallest extent of an organ [m]", organ, least));
  checks.push_back(atMost("largest extent of an organ [m]", organ, most));
  std::ostringstream sentence;
  if (organ < least || organ > most) {
    sentence << "the pre-operative cloud's extent of " << organ << " m is no organ's, outside ["
             << least << ", " << most << "] m" << unitQuestion(organ, least, most);
    return sentence.str();
  }
  const double ratio = extent(intraoperative.points) / organ;
  checks.push_back(
      atLeast("smallest extent of a cloud over the organ's", ratio, settings.min_extent_ratio));
  checks.push_back(
      atMost("largest extent of a cloud over the organ's", ratio, settings.max_extent_ratio));
  if (ratio < settings.min_extent_ratio || ratio > settings.max_extent_ratio) {
    sentence << "the intra-operative cloud's extent of " << ratio * organ << " m is " << ratio
             << " times the organ's " << organ << " m, outside [" << settings.min_extent_ratio
             << ", " << settings.max_extent_ratio << "]"
             << unitQuestion(ratio, settings.min_extent_ratio, settings.max_extent_ratio);
    return sentence.str();
  }
  return std::nullopt;
}

PlausibilityCheck checkOverlap(const Points& predicted, const Points& cloud, double organ_extent,
                               const PlausibilitySettings& settings) {
  const auto reach = static_cast<float>(kOverlapReach * organ_extent);
  const double near = (nearestDistances(cloud, predicted).array() <= reach).cast<double>().mean();
  return atLeast("overlap of the cloud with the predicted region", near, settings.min_overlap);
}

std::vector<PlausibilityCheck> checkOutput(const Registration& registration,
                                           const Eigen::Isometry3d& start, double organ_extent,
                                           const PlausibilitySettings& settings) {
  const Eigen::Isometry3d& pose = registration.T_intraoperative_preoperative;
  const SurfaceResidual& residual = registration.residual;
  const DisplacementStatistics& displacement = registration.displacement;
  const bool finite = pose.matrix().allFinite() && registration.deformation != nullptr &&
                      registration.deformation->displacements().allFinite();
  const auto turn =
      atMost("turn from the start [degree]", degreesBetween(start, pose), settings.max_turn);
  const auto tail = atMost("95th percentile of the surface residual over extent",
                           residual.p95 / organ_extent, settings.max_residual_p95);
  const auto bend = atMost("largest displacement over extent", displacement.max / organ_extent,
                           settings.max_displacement);
  std::vector<PlausibilityCheck> checks{
      PlausibilityCheck{"values that are not finite", finite ? 0.0 : 1.0, 0.0, finite},
      atMost("rotation error", rotationError(pose), kRotationTolerance),
      turn,
      atMost("median surface residual over extent", residual.median / organ_extent,
             settings.max_residual),
      tail,
      atLeast("share of inliers", residual.inlier_fraction, settings.min_inliers),
      bend,
      atMost("stretch", displacement.stretch, settings.max_stretch),
      atLeast("compression", displacement.compression, settings.min_compression),
      atMost("share folded over", displacement.folded_fraction, settings.max_folded)};
  if (!registration.refinement) return checks;
  const RefinementQuality& quality = *registration.refinement;
  const std::vector<PlausibilityCheck> more{
      atMost("residual over that of the rigid part", quality.residual_left,
             settings.max_residual_left),
      atMost("share in view that is missing", quality.missing, settings.max_missing),
      atLeast("mean confidence", quality.confidence, settings.min_confidence),
      atMost("surprise of the displacement", quality.surprise, settings.max_surprise)};
  checks.insert(checks.end(), more.begin(), more.end());
  if (quality.flip_gain) {
    checks.push_back(
        atMost("gain in fit of the organ flipped", *quality.flip_gain, settings.max_flip_gain));
  }
  checks.push_back(jointly({turn, tail, bend, more[1], more[2], more[3]}, settings.max_joint));
  return checks;
}

std::vector<PlausibilityCheck> checkJump(const Eigen::Isometry3d& pose,
                                         const Eigen::Isometry3d& accepted,
                                         const Eigen::Vector3d& organ_centroid,
                                         const PlausibilitySettings& settings) {
  return {
      atMost("jump in translation [m]", (pose * organ_centroid - accepted * organ_centroid).norm(),
             settings.max_jump_translation),
      atMost("jump in rotation [degree]", degreesBetween(accepted, pose),
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
