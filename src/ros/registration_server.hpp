// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dynamic_reconfigure/server.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <ros/spinner.h>
#include <sensor_msgs/PointCloud2.h>
#include <unirit/DeformPoints.h>
#include <unirit/Register.h>
#include <unirit/UniritConfig.h>

#include <memory>
#include <mutex>
#include <thread>

#include "acceptance.hpp"
#include "diagnostics.hpp"
#include "mailbox.hpp"
#include "parameters.hpp"
#include "pipeline.hpp"
#include "tf_bridge.hpp"

namespace unirit {

/// The node: topics and services in, registrations out. Three threads of its own, so that nothing
/// waits for another and a nodelet manager's threads are never held:
/// - callbacks: clouds, /tf, deform_points, thresholds, the timer; none of them computes for long;
/// - register: its calls wait here for the worker, one after the other;
/// - worker: loads the weights, registers, publishes.
class RegistrationServer {
 public:
  /// Topics and services are relative to `private_nh`. Returns at once.
  RegistrationServer(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  ~RegistrationServer();
  RegistrationServer(const RegistrationServer&) = delete;
  RegistrationServer& operator=(const RegistrationServer&) = delete;

 private:
  void connect();
  void onPreoperative(const sensor_msgs::PointCloud2ConstPtr& cloud);
  void onIntraoperative(const sensor_msgs::PointCloud2ConstPtr& cloud);
  void onInitialGuess(const geometry_msgs::PoseWithCovarianceStampedConstPtr& guess);
  void onThresholds(const UniritConfig& config);
  bool onRegister(RegisterRequest& request, RegisterResponse& response);
  bool onDeformPoints(DeformPointsRequest& request, DeformPointsResponse& response);
  void onTimer();

  void work();
  void perform(Pipeline& pipeline, Job& job);
  void noticeTurnedBackClock();

  ros::CallbackQueue callbacks_queue_, register_queue_;  // destroyed after what they serve
  ros::NodeHandle nh_, private_nh_, register_nh_;
  const Parameters parameters_;
  Diagnostics diagnostics_;
  TfBridge bridge_;
  Acceptance acceptance_;
  Mailbox mailbox_;

  std::mutex mutex_;  // guards the next two
  PlausibilitySettings thresholds_;
  ros::Time latest_now_;

  ros::Subscriber preoperative_, intraoperative_, initial_guess_;
  ros::ServiceServer register_, deform_points_;
  boost::recursive_mutex reconfigure_mutex_;
  std::unique_ptr<dynamic_reconfigure::Server<UniritConfig>> reconfigure_;
  ros::WallTimer timer_;
  ros::AsyncSpinner callbacks_spinner_, register_spinner_;
  unsigned voided_ = 0;  // of the last job; used by the worker alone
  std::thread worker_;
};

}  // namespace unirit
