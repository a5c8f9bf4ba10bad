// SPDX-License-Identifier: BSD-3-Clause
#include "diagnostics.hpp"

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <numeric>

#include "unirit/status.hpp"

namespace unirit {
namespace {

using Level = diagnostic_msgs::DiagnosticStatus;

constexpr double kPeriod = 1.0;  // [s]

unsigned char levelOf(std::uint8_t status) {
  if (status == RegistrationResult::SUCCEEDED) return Level::OK;
  return status == RegistrationResult::FAILED ? Level::ERROR : Level::WARN;
}

void addAge(const std::string& key, ros::Time stamp,
            diagnostic_updater::DiagnosticStatusWrapper& status) {
  if (stamp.isZero())
    status.add(key, "none received");
  else
    status.add(key, (ros::Time::now() - stamp).toSec());
}

}  // namespace

Diagnostics::Diagnostics(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
    : updated_(Clock::now()), updater_(nh, private_nh, private_nh.getNamespace()) {
  updater_.setHardwareID("none");
  updater_.add("input", [this](Status& status) { describeInput(status); });
  updater_.add("registration", [this](Status& status) { describeRegistration(status); });
}

void Diagnostics::notePreoperative(ros::Time stamp) {
  const std::lock_guard lock(mutex_);
  preoperative_stamp_ = stamp;
}

void Diagnostics::noteIntraoperative(ros::Time stamp, bool dropped_another) {
  const std::lock_guard lock(mutex_);
  intraoperative_stamp_ = stamp;
  ++clouds_;
  dropped_ += dropped_another ? 1 : 0;
}

void Diagnostics::noteResult(const RegistrationResult& result) {
  const std::lock_guard lock(mutex_);
  result_ = result;
}

void Diagnostics::noteFault(const std::string& sentence) {
  const std::lock_guard lock(mutex_);
  fault_ = sentence;
}

void Diagnostics::noteWarning(const std::string& sentence) {
  const std::lock_guard lock(mutex_);
  warnings_ += (warnings_.empty() ? "" : "; ") + sentence;
}

void Diagnostics::update() {
  {
    const std::lock_guard lock(mutex_);
    const std::chrono::duration<double> elapsed = Clock::now() - updated_;
    if (elapsed.count() < kPeriod) return;
    seconds_since_update_ = elapsed.count();
    updated_ = Clock::now();
  }
  updater_.force_update();
}

void Diagnostics::describeInput(Status& status) {
  const std::lock_guard lock(mutex_);
  const bool waiting = preoperative_stamp_.isZero() || intraoperative_stamp_.isZero();
  status.summary(Level::OK, waiting ? "waiting for clouds" : "receiving clouds");
  addAge("age of the pre-operative cloud [s]", preoperative_stamp_, status);
  addAge("age of the intra-operative cloud [s]", intraoperative_stamp_, status);
  status.add("intra-operative clouds per second", clouds_ / seconds_since_update_);
  status.add("intra-operative clouds dropped for newer ones", dropped_);
  clouds_ = 0;
}

void Diagnostics::describeRegistration(Status& status) {
  const std::lock_guard lock(mutex_);
  if (result_.id == 0) {
    status.summary(Level::OK, "no registration yet");
  } else {
    status.summary(levelOf(result_.status), result_.message);
    status.add("id", result_.id);
    status.add("status", toString(static_cast<unirit::Status>(result_.status)));
    status.add("surface residual, rms [m]", result_.residual_rms);
    for (std::size_t i = 0; i < result_.stages.size(); ++i) {
      status.add(result_.stages[i] + " [ms]", result_.stage_milliseconds[i]);
    }
    status.add("total [ms]", std::accumulate(result_.stage_milliseconds.begin(),
                                             result_.stage_milliseconds.end(), 0.0));
  }
  if (!warnings_.empty()) status.mergeSummary(Level::WARN, warnings_);
  if (!fault_.empty()) status.summary(Level::ERROR, fault_);
}

}  // namespace unirit
