// SPDX-License-Identifier: BSD-3-Clause
// How long after a cloud's stamp its result arrives, and how many come a second: publishes clouds
// of a moving organ to a registration node at a camera's rate, and prints what it measures.
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <unirit/RegistrationResult.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <exception>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "ros/conversions.hpp"
#include "ros/names.hpp"
#include "unirit/random.hpp"
#include "unirit/sampling.hpp"
#include "unirit/simulation/organ_motion.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

constexpr double kDeadline = 30.0;           // for a node and for an answer [s]
constexpr int kUncounted = 5;                // first results: weights are loaded, buffers grow
constexpr double kNoise = 0.001;             // of the cloud's points [m]
constexpr int kFrames = 60;                  // of the organ's motion, shown forth and back
constexpr double kFramePeriod = 1.0 / 15.0;  // of its time between them [s]
constexpr double kTransport = 0.02;          // within which a cloud has reached the node [s]

std_msgs::Header header(const std::string& frame) {
  std_msgs::Header made;
  made.frame_id = frame;
  made.stamp = ros::Time::now();
  return made;
}

/// What is seen of the organ, one cloud a moment of its motion.
std::vector<sensor_msgs::PointCloud2> film(const Surface& organ, int points) {
  const OrganMotion motion(organ.vertices.points, {}, 1);
  std::vector<sensor_msgs::PointCloud2> frames;
  for (int frame = 0; frame < kFrames; ++frame) {
    Surface now = organ;
    now.vertices.points = motion.at(organ.vertices.points, kFramePeriod * frame);
    Points seen = sampleByArea(now, points, static_cast<std::uint64_t>(frame)).points;
    Random random(static_cast<std::uint64_t>(frame));
    for (Eigen::Index k = 0; k < seen.size(); ++k) {
      seen.data()[k] += static_cast<float>(kNoise * random.normal());
    }
    frames.push_back(toMessage(seen, header("camera")));
  }
  return frames;
}

/// A result and when it arrived.
struct Arrival {
  ros::Time time;
  RegistrationResult result;

  double latency() const { return (time - result.header.stamp).toSec(); }
  ros::Time started() const {
    double milliseconds = 0.0;
    for (const double stage : result.stage_milliseconds) milliseconds += stage;
    return time - ros::Duration(milliseconds / 1000.0);
  }
};

class Latency {
 public:
  explicit Latency(const ros::NodeHandle& nh) : nh_(nh) {
    preoperative_ = nh_.advertise<sensor_msgs::PointCloud2>(names::kPreoperative, 1, true);
    intraoperative_ = nh_.advertise<sensor_msgs::PointCloud2>(names::kIntraoperative, 1);
    results_ = nh_.subscribe<RegistrationResult>(
        names::kResult, 100, [this](const RegistrationResultConstPtr& result) { note(*result); });
  }

  bool run();

 private:
  void note(const RegistrationResult& result);
  bool waitForNode() const;
  bool waitForArrivals(std::size_t count);
  bool play(std::vector<sensor_msgs::PointCloud2>& frames);
  int outdated() const;
  void print() const;

  ros::NodeHandle nh_;
  ros::Publisher preoperative_, intraoperative_;
  ros::Subscriber results_;
  std::mutex mutex_;  // guards the arrivals while clouds are published
  std::condition_variable arrived_;
  std::vector<Arrival> arrivals_;
  std::vector<ros::Time> published_;
};

void Latency::note(const RegistrationResult& result) {
  const std::lock_guard<std::mutex> lock(mutex_);
  arrivals_.push_back({ros::Time::now(), result});
  arrived_.notify_all();
}

bool Latency::waitForNode() const {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  while (ros::ok() && ros::WallTime::now() < end) {
    if (intraoperative_.getNumSubscribers() > 0 && results_.getNumPublishers() > 0) return true;
    ros::WallDuration(0.05).sleep();
  }
  return false;
}

bool Latency::waitForArrivals(std::size_t count) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto deadline = std::chrono::duration<double>(kDeadline);
  if (arrived_.wait_for(lock, deadline, [&] { return arrivals_.size() >= count; })) return true;
  std::fprintf(stderr, "latency: no answer within %g s\n", kDeadline);
  return false;
}

/// At the rate asked for; where that is zero, each cloud after the answer to the one before.
bool Latency::play(std::vector<sensor_msgs::PointCloud2>& frames) {
  const int clouds = nh_.param("clouds", 900);
  const double rate = nh_.param("rate", 30.0);
  ros::WallRate pace(rate > 0.0 ? rate : 1.0);
  for (int i = 0; ros::ok() && i < clouds; ++i) {
    const int place = i % (2 * kFrames);
    auto& frame = frames[static_cast<std::size_t>(std::min(place, 2 * kFrames - 1 - place))];
    frame.header.stamp = ros::Time::now();
    published_.push_back(frame.header.stamp);
    intraoperative_.publish(frame);
    if (rate > 0.0) {
      pace.sleep();
    } else if (!waitForArrivals(published_.size())) {
      return false;
    }
  }
  return waitForArrivals(kUncounted + 2);
}

bool Latency::run() {
  const Surface organ = makePhantom("liver", 1, nh_.param("organ_vertices", 20000));
  auto frames = film(organ, nh_.param("cloud_points", 100000));
  std::printf("organ of %ld vertices, clouds of %u points\n",
              static_cast<long>(organ.vertices.size()), frames.front().width);
  preoperative_.publish(toMessage(organ.vertices.points, header("preoperative")));
  if (!waitForNode() || !play(frames)) return false;
  results_.shutdown();
  print();
  return true;
}

/// Results of a cloud that was not the newest when the work on it began.
int Latency::outdated() const {
  int count = 0;
  for (const Arrival& arrival : arrivals_) {
    const auto next =
        std::upper_bound(published_.begin(), published_.end(), arrival.result.header.stamp);
    if (next == published_.end()) continue;
    if (*next + ros::Duration(kTransport) < arrival.started()) ++count;
  }
  return count;
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

void Latency::print() const {
  std::vector<double> total;                          // [ms]
  std::map<std::string, std::vector<double>> stages;  // [ms]
  int succeeded = 0;
  for (std::size_t i = kUncounted; i < arrivals_.size(); ++i) {
    const RegistrationResult& result = arrivals_[i].result;
    total.push_back(1000.0 * arrivals_[i].latency());
    succeeded += result.status == RegistrationResult::SUCCEEDED ? 1 : 0;
    for (std::size_t k = 0; k < result.stages.size(); ++k) {
      stages[result.stages[k]].push_back(result.stage_milliseconds[k]);
    }
  }
  const auto row = [](const std::string& name, const std::vector<double>& values) {
    std::printf("%-24s p50 %7.1f ms   p99 %7.1f ms   of %zu\n", name.c_str(), quantile(values, 0.5),
                quantile(values, 0.99), values.size());
  };
  for (const auto& [name, values] : stages) row(name, values);
  row("cloud to result", total);
  const double seconds = (arrivals_.back().time - arrivals_[kUncounted].time).toSec();
  std::printf("%.1f results a second, %d of %zu succeeded, %d not of the newest cloud\n",
              static_cast<double>(total.size() - 1) / seconds, succeeded, total.size(), outdated());
  std::printf("last result: %s\n", arrivals_.back().result.message.c_str());
}

}  // namespace
}  // namespace unirit

int main(int argc, char** argv) {
  ros::init(argc, argv, "latency");
  try {
    ros::AsyncSpinner spinner(1);
    spinner.start();
    return unirit::Latency(ros::NodeHandle("~")).run() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "latency: %s\n", error.what());
    return 1;
  }
}
