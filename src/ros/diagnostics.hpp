// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/ros.h>
#include <unirit/RegistrationResult.h>

#include <chrono>
#include <mutex>
#include <string>

namespace unirit {

/// What goes on, once a second on /diagnostics: rates and ages of the input, dropped clouds, state
/// of the registration, compute times. The notes may come from any thread.
class Diagnostics {
 public:
  Diagnostics(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);

  void notePreoperative(ros::Time stamp);
  void noteIntraoperative(ros::Time stamp, bool dropped_another);
  void noteResult(const RegistrationResult& result);
  /// Sentences that hold until the node is restarted.
  void noteFault(const std::string& sentence);
  void noteWarning(const std::string& sentence);

  /// Publishes where a second of steady time has gone by since it last did.
  void update();

 private:
  using Clock = std::chrono::steady_clock;
  using Status = diagnostic_updater::DiagnosticStatusWrapper;

  void describeInput(Status& status);
  void describeRegistration(Status& status);

  std::mutex mutex_;  // guards everything below but the updater
  ros::Time preoperative_stamp_, intraoperative_stamp_;
  int clouds_ = 0;   // since the last update
  int dropped_ = 0;  // since the start
  std::string fault_, warnings_;
  RegistrationResult result_;  // the last one; id 0: none yet
  Clock::time_point updated_;
  double seconds_since_update_ = 0.0;

  diagnostic_updater::Updater updater_;  // used by the thread that calls update
};

}  // namespace unirit
