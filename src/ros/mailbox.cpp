// SPDX-License-Identifier: BSD-3-Clause
#include "mailbox.hpp"

#include <boost/make_shared.hpp>
#include <utility>

namespace unirit {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointCloud2ConstPtr;

bool sameSurface(const PointCloud2& a, const PointCloud2& b) {
  return a.header.frame_id == b.header.frame_id && a.width == b.width && a.height == b.height &&
         a.point_step == b.point_step && a.row_step == b.row_step && a.data == b.data;
}

/// The request's own cloud, or null where it has none.
PointCloud2ConstPtr ownCloud(const PointCloud2& cloud) {
  if (cloud.width == 0 || cloud.height == 0) return nullptr;
  return boost::make_shared<const PointCloud2>(cloud);
}

}  // namespace

bool Mailbox::putPreoperative(const PointCloud2ConstPtr& cloud) {
  const std::lock_guard lock(mutex_);
  const bool replaces = preoperative_ && !sameSurface(*preoperative_, *cloud);
  preoperative_ = cloud;
  changed_.notify_one();
  return replaces;
}

bool Mailbox::putIntraoperative(const PointCloud2ConstPtr& cloud, bool wanted) {
  const std::lock_guard lock(mutex_);
  intraoperative_ = cloud;
  if (!wanted) return false;
  Job job;
  job.intraoperative = cloud;
  job.guess = std::exchange(guess_, std::nullopt);
  if (!every_cloud_ && !jobs_.empty() && !jobs_.back().answer) {
    if (!job.guess) job.guess = jobs_.back().guess;
    jobs_.back() = std::move(job);
    return true;
  }
  push(std::move(job));
  return false;
}

void Mailbox::putGuess(const geometry_msgs::PoseStamped& guess) {
  const std::lock_guard lock(mutex_);
  guess_ = guess;
}

std::future<RegisterResponse> Mailbox::putRequest(const RegisterRequest& request) {
  const std::lock_guard lock(mutex_);
  Job job;
  job.preoperative = ownCloud(request.preoperative);
  job.intraoperative = ownCloud(request.intraoperative);
  job.detached = job.preoperative || job.intraoperative;
  if (!job.preoperative) job.preoperative = preoperative_;
  if (!job.intraoperative) job.intraoperative = intraoperative_;
  if (!job.detached) job.guess = std::exchange(guess_, std::nullopt);
  if (request.use_initial_guess) job.guess = request.initial_guess;
  auto answer = job.answer.emplace().get_future();
  push(std::move(job));
  return answer;
}

void Mailbox::push(Job job) {
  if (stopped_) return;
  jobs_.push_back(std::move(job));
  changed_.notify_one();
}

bool Mailbox::ready() const {
  if (jobs_.empty()) return false;
  return !every_cloud_ || preoperative_ || jobs_.front().answer;
}

std::optional<Job> Mailbox::take() {
  std::unique_lock lock(mutex_);
  waiting_ = true;
  changed_.wait(lock, [&] { return stopped_ || ready(); });
  waiting_ = false;
  if (stopped_) return std::nullopt;
  std::optional<Job> job(std::move(jobs_.front()));
  jobs_.pop_front();
  if (!job->preoperative) job->preoperative = preoperative_;
  return job;
}

bool Mailbox::idle() const {
  const std::lock_guard lock(mutex_);
  return waiting_ && jobs_.empty();
}

void Mailbox::clear() {
  const std::lock_guard lock(mutex_);
  jobs_.clear();
  intraoperative_.reset();
  guess_.reset();
}

void Mailbox::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  jobs_.clear();
  changed_.notify_all();
}

}  // namespace unirit
