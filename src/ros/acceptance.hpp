// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <memory>
#include <mutex>

#include "diagnostics.hpp"
#include "parameters.hpp"
#include "pipeline.hpp"
#include "tf_bridge.hpp"

namespace unirit {

/// The accepted registration (the last that succeeded) and all that is published of it. Every
/// function is safe to call from any thread.
class Acceptance {
 public:
  /// What is accepted at some moment. `voided` counts what makes a running registration void:
  /// another organ, or a clock that was turned back.
  struct State {
    std::shared_ptr<const Attempt> attempt;  ///< null: nothing is accepted
    bool stale = false;
    unsigned voided = 0;
  };

  Acceptance(ros::NodeHandle private_nh, const NodeSettings& settings, TfBridge& bridge,
             Diagnostics& diagnostics);

  State state() const;

  /// The accepted registration where it is fresh at the time given, else null.
  std::shared_ptr<const Attempt> freshAt(ros::Time at) const;

  /// Publishes an attempt and accepts it if it succeeded; refused ones come with their cloud.
  /// Whether that was done: not where it began before state().voided changed.
  bool publish(std::shared_ptr<const Attempt> attempt,
               const sensor_msgs::PointCloud2ConstPtr& intraoperative, unsigned voided);

  /// Broadcasts the accepted pose with this stamp while it is fresh.
  void broadcast(ros::Time stamp);

  /// Withdraws the accepted registration once where it has outlived stale_after: empty clouds take
  /// the place of the organ's, a STALE result says so, and broadcasting ends.
  void withdrawIfStale(ros::Time at);

  /// Nothing is accepted any more, and what runs is void.
  void reset();

 private:
  bool isFresh(ros::Time at) const;
  void sendTransform(ros::Time stamp);
  void publishEmptyClouds();

  const NodeSettings settings_;
  TfBridge& bridge_;
  Diagnostics& diagnostics_;
  ros::Publisher deformed_, rigid_, result_, refused_;
  mutable std::mutex mutex_;  // guards the state; held while publishing, for the order of messages
  State state_;
};

}  // namespace unirit
