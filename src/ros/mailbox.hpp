// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/PoseStamped.h>
#include <sensor_msgs/PointCloud2.h>
#include <unirit/Register.h>

#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <optional>

namespace unirit {

/// One registration to be made.
struct Job {
  sensor_msgs::PointCloud2ConstPtr preoperative;    ///< null where none has been received
  sensor_msgs::PointCloud2ConstPtr intraoperative;  ///< null where none has been received
  std::optional<geometry_msgs::PoseStamped> guess;
  bool detached = false;  ///< clouds of the caller's own: what is accepted is neither read nor set
  std::optional<std::promise<RegisterResponse>> answer;  ///< where a service call waits
};

/// Hands clouds from the callbacks to the one worker. Newest wins: a cloud that waits is replaced
/// by the next one. With `every_cloud` none is: all wait in order, also for the pre-operative
/// cloud.
class Mailbox {
 public:
  explicit Mailbox(bool every_cloud) : every_cloud_(every_cloud) {}

  /// Whether the surface replaces another one; the same again, frame included, does not.
  bool putPreoperative(const sensor_msgs::PointCloud2ConstPtr& cloud);

  /// `wanted`: whether the cloud is to be registered, or only kept for a service call. Whether
  /// another cloud was dropped for it.
  bool putIntraoperative(const sensor_msgs::PointCloud2ConstPtr& cloud, bool wanted);

  /// For the next job but a detached one.
  void putGuess(const geometry_msgs::PoseStamped& guess);

  /// Fills in the latest clouds where the request has none of its own. The future throws
  /// std::future_error where the request is dropped by clear or stop.
  std::future<RegisterResponse> putRequest(const RegisterRequest& request);

  /// Waits for a job; nothing once stopped.
  std::optional<Job> take();

  /// Whether no job waits and none is being worked on.
  bool idle() const;

  /// Drops what waits, the latest cloud and the guess; the pre-operative cloud stays.
  void clear();
  void stop();

 private:
  bool ready() const;
  void push(Job job);

  const bool every_cloud_;
  mutable std::mutex mutex_;  // guards everything below
  std::condition_variable changed_;
  bool stopped_ = false;
  bool waiting_ = false;  // whether the worker is in take
  sensor_msgs::PointCloud2ConstPtr preoperative_;
  sensor_msgs::PointCloud2ConstPtr intraoperative_;
  std::optional<geometry_msgs::PoseStamped> guess_;
  std::deque<Job> jobs_;
};

}  // namespace unirit
