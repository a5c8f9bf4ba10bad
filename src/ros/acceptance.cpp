// SPDX-License-Identifier: BSD-3-Clause
#include "acceptance.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "conversions.hpp"
#include "names.hpp"

namespace unirit {
namespace {

constexpr double kLogPeriod = 1.0;  // [s]; a camera's rate would flood the log

void log(const RegistrationResult& result) {
  const char* status = toString(static_cast<Status>(result.status));
  if (result.status == RegistrationResult::SUCCEEDED) {
    ROS_DEBUG("registration %u %s: %s", result.id, status, result.message.c_str());
  } else {
    ROS_WARN_THROTTLE(kLogPeriod, "registration %u %s: %s", result.id, status,
                      result.message.c_str());
  }
}

/// Of its input or of what came out; messages that are no clouds at all fail before any check.
bool failedACheck(const RegistrationResult& result) {
  return std::any_of(result.checks.begin(), result.checks.end(),
                     [](const Check& check) { return check.passed == 0; });
}

}  // namespace

Acceptance::Acceptance(ros::NodeHandle private_nh, const NodeSettings& settings, TfBridge& bridge,
                       Diagnostics& diagnostics)
    : settings_(settings), bridge_(bridge), diagnostics_(diagnostics) {
  constexpr bool kLatched = true;
  const unsigned queue = settings.every_cloud ? 0 : 1;  // 0: nothing is dropped
  deformed_ = private_nh.advertise<sensor_msgs::PointCloud2>(names::kDeformed, queue, kLatched);
  rigid_ = private_nh.advertise<sensor_msgs::PointCloud2>(names::kRigid, queue, kLatched);
  result_ = private_nh.advertise<RegistrationResult>(names::kResult, 0, kLatched);
  refused_ = private_nh.advertise<sensor_msgs::PointCloud2>(names::kRefused, queue);
}

Acceptance::State Acceptance::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::shared_ptr<const Attempt> Acceptance::freshAt(ros::Time at) const {
  const std::lock_guard lock(mutex_);
  return isFresh(at) ? state_.attempt : nullptr;
}

bool Acceptance::isFresh(ros::Time at) const {
  if (!state_.attempt || state_.stale) return false;
  return std::abs((at - state_.attempt->result.header.stamp).toSec()) <= settings_.stale_after;
}

bool Acceptance::publish(std::shared_ptr<const Attempt> attempt,
                         const sensor_msgs::PointCloud2ConstPtr& intraoperative, unsigned voided) {
  const std::lock_guard lock(mutex_);
  if (voided != state_.voided) return false;
  const RegistrationResult& result = attempt->result;
  log(result);
  diagnostics_.noteResult(result);
  if (result.status == RegistrationResult::SUCCEEDED) {
    state_.attempt = attempt;
    state_.stale = false;
    deformed_.publish(attempt->deformed);
    rigid_.publish(attempt->rigid);
    sendTransform(result.header.stamp);
  } else if (failedACheck(result)) {
    refused_.publish(intraoperative);
  }
  result_.publish(result);
  return true;
}

void Acceptance::broadcast(ros::Time stamp) {
  const std::lock_guard lock(mutex_);
  if (isFresh(stamp)) sendTransform(stamp);
}

void Acceptance::sendTransform(ros::Time stamp) {
  if (!settings_.publish_tf) return;
  const Attempt& attempt = *state_.attempt;
  const std::string& organ = attempt.result.preoperative_frame;
  if (settings_.invert_tf) {
    bridge_.publish(organ, attempt.fixed_frame, attempt.T_fixed_preoperative.inverse(), stamp);
  } else {
    bridge_.publish(attempt.fixed_frame, organ, attempt.T_fixed_preoperative, stamp);
  }
}

void Acceptance::withdrawIfStale(ros::Time at) {
  const std::lock_guard lock(mutex_);
  if (!state_.attempt || state_.stale || isFresh(at)) return;
  state_.stale = true;
  publishEmptyClouds();
  RegistrationResult result = state_.attempt->result;
  std::ostringstream sentence;
  sentence << "registration " << result.id << " has outlived stale_after, " << settings_.stale_after
           << " s, and is withdrawn";
  result.status = RegistrationResult::STALE;
  result.message = sentence.str();
  log(result);
  diagnostics_.noteResult(result);
  result_.publish(result);
}

void Acceptance::reset() {
  const std::lock_guard lock(mutex_);
  if (state_.attempt && !state_.stale) publishEmptyClouds();
  state_ = {nullptr, false, state_.voided + 1};
}

void Acceptance::publishEmptyClouds() {
  const sensor_msgs::PointCloud2 empty = emptyCloud(state_.attempt->result.header);
  deformed_.publish(empty);
  rigid_.publish(empty);
}

}  // namespace unirit
