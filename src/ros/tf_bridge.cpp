// SPDX-License-Identifier: BSD-3-Clause
#include "tf_bridge.hpp"

#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <chrono>
#include <sstream>
#include <stdexcept>

#include "refusal.hpp"
#include "result_message.hpp"

namespace unirit {
namespace {

constexpr char kAuthority[] = "tf";  // tf2 wants to know who said it, and does nothing with it
constexpr unsigned kQueueSize = 1000;
constexpr std::chrono::seconds kSilence{10};  // after it, who published a moving edge has ended

/// Without the leading slash of old, which tf2 drops too.
std::string bare(const std::string& frame) {
  return frame.empty() || frame.front() != '/' ? frame : frame.substr(1);
}

}  // namespace

TfBridge::TfBridge(ros::NodeHandle nh, double history) : buffer_(ros::Duration(history)) {
  using tf2_msgs::TFMessage;
  using Callback = boost::function<void(const Event&)>;
  moving_ = nh.subscribe<TFMessage>(
      "/tf", kQueueSize, Callback([this](const Event& event) { onTransforms(event, false); }));
  static_ =
      nh.subscribe<TFMessage>("/tf_static", kQueueSize,
                              Callback([this](const Event& event) { onTransforms(event, true); }));
}

void TfBridge::onTransforms(const Event& event, bool is_static) {
  {
    const std::lock_guard lock(mutex_);
    for (const auto& transform : event.getConstMessage()->transforms) {
      if (isOwn(transform)) continue;
      const std::string parent = bare(transform.header.frame_id);
      const std::string child = bare(transform.child_frame_id);
      Claim& claim = claims_[child];
      if (is_static || !claim.is_static) {
        claim = {parent, event.getPublisherName(), is_static, Clock::now()};
      }
      if (own_edges_.count({parent, child}) > 0) continue;
      buffer_.setTransform(transform, kAuthority, is_static);
    }
  }
  arrived_.notify_all();
}

/// Told by what was sent, not by the publisher's name: nodelets of one manager share theirs. What
/// was sent before the one heard of now has been lost.
bool TfBridge::isOwn(const geometry_msgs::TransformStamped& transform) {
  const auto sent = std::find(sent_.begin(), sent_.end(), transform);
  if (sent == sent_.end()) return false;
  sent_.erase(sent_.begin(), sent + 1);
  return true;
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
  own_edges_.emplace(bare(parent), bare(child));
  const auto found = claims_.find(bare(child));
  if (found == claims_.end()) return;
  const Claim& claim = found->second;
  if (!claim.is_static && Clock::now() - claim.received > kSilence) return;
  throw Refusal(Status::kInvalidInput, "frame '" + child + "' already has parent '" + claim.parent +
                                           "' on /tf, by node '" + claim.publisher +
                                           "', so its edge to '" + parent +
                                           "' cannot be published: end that node, or set "
                                           "publish_tf to false");
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
  sent_.push_back(message);
  if (sent_.size() > kQueueSize) sent_.pop_front();
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
