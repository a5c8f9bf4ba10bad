// SPDX-License-Identifier: BSD-3-Clause
// How long after a cloud's stamp its result arrives: publishes one large cloud after another to a
// registration node and prints the quantiles of what it measures.
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <unirit/RegistrationResult.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "ros/conversions.hpp"
#include "ros/names.hpp"
#include "unirit/random.hpp"
#include "unirit/sampling.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

constexpr double kDeadline = 30.0;  // for a node and for each answer [s]
constexpr int kUncounted = 5;       // first clouds: weights are loaded, buffers grow
constexpr double kNoise = 0.001;    // of the cloud's points [m]

std_msgs::Header header(const std::string& frame) {
  std_msgs::Header made;
  made.frame_id = frame;
  made.stamp = ros::Time::now();
  return made;
}

class Latency {
 public:
  explicit Latency(const ros::NodeHandle& nh) : nh_(nh) {
    preoperative_ = nh_.advertise<sensor_msgs::PointCloud2>(names::kPreoperative, 1, true);
    intraoperative_ = nh_.advertise<sensor_msgs::PointCloud2>(names::kIntraoperative, 1);
    results_ = nh_.subscribe<RegistrationResult>(
        names::kResult, 10, [this](const RegistrationResultConstPtr& result) { result_ = result; });
  }

  bool run();

 private:
  bool waitForAnswer(ros::Time stamp);
  void print() const;

  ros::NodeHandle nh_;
  ros::Publisher preoperative_, intraoperative_;
  ros::Subscriber results_;
  RegistrationResultConstPtr result_;
  std::vector<double> total_;                          // [ms]
  std::map<std::string, std::vector<double>> stages_;  // [ms]
};

bool Latency::waitForAnswer(ros::Time stamp) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  while (ros::ok() && ros::WallTime::now() < end) {
    if (result_ && result_->header.stamp == stamp) return true;
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
  }
  std::fprintf(stderr, "latency: no answer within %g s\n", kDeadline);
  return false;
}

bool Latency::run() {
  const int clouds = nh_.param("clouds", 200);
  const Surface organ = makePhantom("liver", 1, nh_.param("organ_vertices", 20000));
  Points seen = sampleByArea(organ, nh_.param("cloud_points", 100000), 1).points;
  Random random(1);
  seen = seen.unaryExpr(
      [&](float coordinate) { return coordinate + static_cast<float>(kNoise * random.normal()); });
  preoperative_.publish(toMessage(organ.vertices.points, header("preoperative")));
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  while (ros::ok() && ros::WallTime::now() < end &&
         (intraoperative_.getNumSubscribers() == 0 || results_.getNumPublishers() == 0)) {
    ros::WallDuration(0.05).sleep();
  }
  sensor_msgs::PointCloud2 message = toMessage(seen, header("camera"));
  std::printf("organ of %ld vertices, clouds of %ld points\n",
              static_cast<long>(organ.vertices.size()), static_cast<long>(seen.cols()));
  for (int i = 0; i < clouds + kUncounted; ++i) {
    message.header.stamp = ros::Time::now();
    intraoperative_.publish(message);
    if (!waitForAnswer(message.header.stamp)) return false;
    if (i < kUncounted) continue;
    total_.push_back(1000.0 * (ros::Time::now() - message.header.stamp).toSec());
    for (std::size_t k = 0; k < result_->stages.size(); ++k) {
      stages_[result_->stages[k]].push_back(result_->stage_milliseconds[k]);
    }
  }
  print();
  return true;
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

void Latency::print() const {
  const auto row = [](const std::string& name, const std::vector<double>& values) {
    std::printf("%-24s p50 %7.1f ms   p99 %7.1f ms   of %zu\n", name.c_str(), quantile(values, 0.5),
                quantile(values, 0.99), values.size());
  };
  for (const auto& [name, values] : stages_) row(name, values);
  row("cloud to result", total_);
  std::printf("last result: %s\n", result_->message.c_str());
}

}  // namespace
}  // namespace unirit

int main(int argc, char** argv) {
  ros::init(argc, argv, "latency");
  try {
    return unirit::Latency(ros::NodeHandle("~")).run() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "latency: %s\n", error.what());
    return 1;
  }
}
