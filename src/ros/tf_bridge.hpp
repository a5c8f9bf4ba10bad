// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/ros.h>
#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/transform_broadcaster.h>

#include <Eigen/Geometry>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace unirit {

/// The node's view of /tf without what it publishes itself, so that no lookup can rest on its own
/// registration. All functions are safe to call from any thread; a lookup that waits needs another
/// thread to serve the callback queue of `nh`.
class TfBridge {
 public:
  /// `history`: how long transforms are remembered [s].
  TfBridge(ros::NodeHandle nh, double history);

  /// T_target_source at `stamp`; waits at most `timeout` [s] of steady time for it. Throws Refusal
  /// (NO_TRANSFORM) naming both frames.
  Eigen::Isometry3d lookUp(const std::string& target, const std::string& source, ros::Time stamp,
                           double timeout);

  /// Takes parent -> child as the edge this node publishes: it is left out of lookups from now on.
  /// Throws Refusal (INVALID_INPUT) where the names are equal, or somebody else gives the child a
  /// parent, be it the same one: of two publishers of an edge no listener can tell which to
  /// believe.
  void claimEdge(const std::string& parent, const std::string& child);

  /// Publishes the claimed edge. A stamp not after the last one is skipped, so that none repeats.
  /// Throws std::invalid_argument where the transform is not finite.
  void publish(const std::string& parent, const std::string& child,
               const Eigen::Isometry3d& T_parent_child, ros::Time stamp);

  /// Forgets moving transforms and stamps: for a clock that was turned back.
  void reset();

  /// Ends every wait, now and later; lookups then only see what is there.
  void stop();

 private:
  using Edge = std::pair<std::string, std::string>;  // parent, child
  using Clock = std::chrono::steady_clock;
  using Event = ros::MessageEvent<const tf2_msgs::TFMessage>;

  /// What somebody else last said of a frame's parent; a static edge is said once, and holds.
  struct Claim {
    std::string parent, publisher;
    bool is_static = false;
    Clock::time_point received;
  };

  void onTransforms(const Event& event, bool is_static);
  bool isOwn(const geometry_msgs::TransformStamped& transform);
  std::string tryLookUp(const std::string& target, const std::string& source, ros::Time stamp,
                        Eigen::Isometry3d& transform);

  std::mutex mutex_;  // guards everything below
  std::condition_variable arrived_;
  bool stopped_ = false;
  tf2::BufferCore buffer_;
  std::set<Edge> own_edges_;
  std::map<std::string, Claim> claims_;               // of others, by child
  std::deque<geometry_msgs::TransformStamped> sent_;  // and not yet heard of on /tf
  ros::Time last_published_;

  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Subscriber moving_, static_;
};

}  // namespace unirit
