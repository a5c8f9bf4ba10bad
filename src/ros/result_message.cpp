// SPDX-License-Identifier: BSD-3-Clause
#include "result_message.hpp"

#include <cmath>

#include "refusal.hpp"

namespace unirit {
namespace {

constexpr double kQuaternionTolerance = 0.01;  // of its length; rounding and no more

static_assert(static_cast<int>(Status::kSucceeded) == RegistrationResult::SUCCEEDED);
static_assert(static_cast<int>(Status::kRefused) == RegistrationResult::REFUSED);
static_assert(static_cast<int>(Status::kInvalidInput) == RegistrationResult::INVALID_INPUT);
static_assert(static_cast<int>(Status::kNoTransform) == RegistrationResult::NO_TRANSFORM);
static_assert(static_cast<int>(Status::kFailed) == RegistrationResult::FAILED);
static_assert(static_cast<int>(Status::kStale) == RegistrationResult::STALE);

Check toMessage(const PlausibilityCheck& check) {
  Check message;
  message.name = check.name;
  message.value = check.value;
  message.limit = check.limit;
  message.passed = check.passed;
  return message;
}

}  // namespace

void fillIn(const Registration& registration, double inlier_tolerance, RegistrationResult& result) {
  result.status = static_cast<std::uint8_t>(registration.status);
  result.message = registration.message;
  result.transform = toMessage(registration.T_intraoperative_preoperative);
  result.residual_rms = registration.residual.rms;
  result.residual_median = registration.residual.median;
  result.residual_p95 = registration.residual.p95;
  result.inlier_fraction = registration.residual.inlier_fraction;
  result.inlier_tolerance = inlier_tolerance;
  result.coverage = registration.residual.coverage;
  result.displacement_rms = registration.displacement.rms;
  result.displacement_p95 = registration.displacement.p95;
  result.displacement_max = registration.displacement.max;
  result.folded_fraction = registration.displacement.folded_fraction;
  for (const auto& check : registration.checks) result.checks.push_back(toMessage(check));
  for (const auto& stage : registration.stages) {
    result.stages.push_back(stage.stage);
    result.stage_milliseconds.push_back(stage.milliseconds);
  }
}

void fillIn(const std::vector<StagePoints>& preprocessing, RegistrationResult& result) {
  for (const StagePoints& stage : preprocessing) {
    result.preprocessing_stages.push_back(stage.stage);
    result.preprocessing_points.push_back(static_cast<std::uint32_t>(stage.points));
  }
}

Eigen::Isometry3d fromMessage(const geometry_msgs::Pose& pose, const std::string& name) {
  const auto& p = pose.position;
  const auto& q = pose.orientation;
  const Eigen::Vector3d translation(p.x, p.y, p.z);
  const Eigen::Quaterniond rotation(q.w, q.x, q.y, q.z);
  if (!translation.allFinite() || !rotation.coeffs().allFinite()) {
    throw Refusal(Status::kInvalidInput, name + " is not finite");
  }
  if (std::abs(rotation.norm() - 1.0) > kQuaternionTolerance) {
    throw Refusal(Status::kInvalidInput, name + "'s quaternion has length " +
                                             std::to_string(rotation.norm()) + " instead of 1");
  }
  return Eigen::Translation3d(translation) * rotation.normalized();
}

geometry_msgs::Transform toMessage(const Eigen::Isometry3d& transform) {
  const Eigen::Quaterniond rotation = Eigen::Quaterniond(transform.linear()).normalized();
  geometry_msgs::Transform message;
  message.translation.x = transform.translation().x();
  message.translation.y = transform.translation().y();
  message.translation.z = transform.translation().z();
  message.rotation.x = rotation.x();
  message.rotation.y = rotation.y();
  message.rotation.z = rotation.z();
  message.rotation.w = rotation.w();
  return message;
}

}  // namespace unirit
