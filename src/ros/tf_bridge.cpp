// SPDX-License-Identifier: BSD-3-Clause
#include "tf_bridge.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <chrono>
#include <sstream>
#include <stdexcept>

#include "refusal.hpp"
#include "result_message.hpp"

namespace unirit {
namespace {

constexpr char kAuthority[] = "tf";  // tf2 wants to know who said it, and does nothing with it
constexpr unsigned kQueueSize = 1000;

}  // namespace

TfBridge::TfBridge(ros::NodeHandle nh, double history) : buffer_(ros::Duration(history)) {
  moving_ = nh.subscribe<tf2_msgs::TFMessage>(
      "/tf", kQueueSize, [this](const auto& message) { onTransforms(message, false); });
  static_ = nh.subscribe<tf2_msgs::TFMessage>(
      "/tf_static", kQueueSize, [this](const auto& message) { onTransforms(message, true); });
}

void TfBridge::onTransforms(const tf2_msgs::TFMessageConstPtr& message, bool is_static) {
  {
    const std::lock_guard lock(mutex_);
    for (const auto& transform : message->transforms) {
      if (own_edges_.count({transform.header.frame_id, transform.child_frame_id}) > 0) continue;
      buffer_.setTransform(transform, kAuthority, is_static);
    }
  }
  arrived_.notify_all();
}

std::string TfBridge::tryLookUp(const std::string& target, const std::string& source,
                                ros::Time stamp, Eigen::Isometry3d& transform) {
  try {
    transform = tf2::transformToEigen(buffer_.lookupTransform(target, source, stamp));
    return "";
  } catch (const tf2::TransformException& error) {
    return error.what();
  }
}

Eigen::Isometry3d TfBridge::lookUp(const std::string& target, const std::string& source,
                                   ros::Time stamp, double timeout) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  if (target == source) return transform;
  std::string fault;
  std::unique_lock lock(mutex_);
  arrived_.wait_for(lock, std::chrono::duration<double>(timeout), [&] {
    fault = tryLookUp(target, source, stamp, transform);
    return fault.empty() || stopped_;
  });
  if (!fault.empty()) {
    std::ostringstream sentence;
    sentence << "no transform from frame '" << source << "' to frame '" << target
             << "' at the cloud's stamp " << stamp << ": " << fault;
    throw Refusal(Status::kNoTransform, sentence.str());
  }
  if (!transform.matrix().allFinite()) {
    throw Refusal(Status::kNoTransform, "the transform from frame '" + source + "' to frame '" +
                                            target + "' is not finite");
  }
  transform.linear() = Eigen::Quaterniond(transform.linear()).normalized().toRotationMatrix();
  return transform;
}

void TfBridge::claimEdge(const std::string& parent, const std::string& child) {
  if (parent == child) {
    throw Refusal(Status::kInvalidInput, "frame '" + parent +
                                             "' would be its own parent: the pre-operative cloud "
                                             "needs a frame of its own");
  }
  const std::lock_guard lock(mutex_);
  own_edges_.emplace(parent, child);
  std::string other;
  if (!buffer_._getParent(child, ros::Time(), other) || own_edges_.count({other, child}) > 0) {
    return;
  }
  throw Refusal(Status::kInvalidInput, "frame '" + child + "' already has parent '" + other +
                                           "' on /tf, so its edge to '" + parent +
                                           "' cannot be published");
}

void TfBridge::publish(const std::string& parent, const std::string& child,
                       const Eigen::Isometry3d& T_parent_child, ros::Time stamp) {
  if (!T_parent_child.matrix().allFinite()) {
    throw std::invalid_argument("T_parent_child: not finite");
  }
  geometry_msgs::TransformStamped message;
  message.header.frame_id = parent;
  message.header.stamp = stamp;
  message.child_frame_id = child;
  message.transform = toMessage(T_parent_child);
  const std::lock_guard lock(mutex_);
  if (stamp <= last_published_) return;
  last_published_ = stamp;
  broadcaster_.sendTransform(message);
}

void TfBridge::reset() {
  const std::lock_guard lock(mutex_);
  buffer_.clear();
  last_published_ = ros::Time();
}

void TfBridge::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  arrived_.notify_all();
}

}  // namespace unirit
