// SPDX-License-Identifier: BSD-3-Clause
#include "client.hpp"

#include <gtest/gtest.h>
#include <tf2_eigen/tf2_eigen.h>

#include <chrono>
#include <future>
#include <memory>
#include <thread>

#include "conversions.hpp"

namespace unirit::test {

bool finishes(const std::function<void()>& call) {
  // A call that hangs must not hang the test, so its thread is left behind
  auto done = std::make_shared<std::promise<void>>();
  auto finished = done->get_future();
  std::thread([call, done] {
    call();
    done->set_value();
  }).detach();
  const bool in_time =
      finished.wait_for(std::chrono::duration<double>(kDeadline)) == std::future_status::ready;
  EXPECT_TRUE(in_time) << "a call did not end within " << kDeadline << " s";
  return in_time;
}

Client::Client(const std::string& node) : nh_(node) {
  organ_ = nh_.advertise<sensor_msgs::PointCloud2>("preoperative", 1, true);
  cloud_ = nh_.advertise<sensor_msgs::PointCloud2>("intraoperative", 0);
  guess_ = nh_.advertise<geometry_msgs::PoseWithCovarianceStamped>("initial_guess", 1);
  subscribers_ = {
      listen<RegistrationResult>("result", [this](const auto& m) { results.push_back(m); }),
      listen<sensor_msgs::PointCloud2>("deformed", [this](const auto& m) { deformed = m; }),
      listen<sensor_msgs::PointCloud2>("rigid", [this](const auto& m) { rigid = m; }),
      listen<sensor_msgs::PointCloud2>("refused", [this](const auto& m) { refused = m; }),
      listen<tf2_msgs::TFMessage>("/tf", [this](const auto& m) {
        transforms.insert(transforms.end(), m.transforms.begin(), m.transforms.end());
      })};
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  const auto connected = [this] {
    for (const auto& subscriber : subscribers_) {
      if (subscriber.getNumPublishers() == 0) return false;
    }
    return organ_.getNumSubscribers() > 0 && cloud_.getNumSubscribers() > 0 &&
           guess_.getNumSubscribers() > 0;
  };
  while (!connected() && ros::WallTime::now() < end) ros::WallDuration(0.01).sleep();
  EXPECT_TRUE(connected()) << "node " << node << " is not there";
}

template <class Message, class Store>
ros::Subscriber Client::listen(const std::string& topic, Store store) {
  return nh_.subscribe<Message>(topic, 0, [this, store](const boost::shared_ptr<const Message>& m) {
    const std::lock_guard lock(mutex_);
    store(*m);
    received_.notify_all();
  });
}

void Client::sendGuess(const std::string& frame, const Eigen::Isometry3d& pose) {
  geometry_msgs::PoseWithCovarianceStamped guess;
  guess.header.frame_id = frame;
  guess.header.stamp = ros::Time::now();
  guess.pose.pose = tf2::toMsg(pose);
  guess_.publish(guess);
}

RegisterResponse Client::callRegister(const RegisterRequest& request) {
  auto service = std::make_shared<Register>();
  service->request = request;
  const std::string name = nh_.resolveName("register");
  if (!finishes([service, name] { EXPECT_TRUE(callService(name, *service)) << name; })) {
    return {};
  }
  return service->response;
}

DeformPointsResponse Client::callDeformPoints(const std::string& frame, const Points& points) {
  auto service = std::make_shared<DeformPoints>();
  service->request.header.frame_id = frame;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    geometry_msgs::Point point;
    point.x = points(0, i);
    point.y = points(1, i);
    point.z = points(2, i);
    service->request.points.push_back(point);
  }
  const std::string name = nh_.resolveName("deform_points");
  if (!finishes([service, name] { EXPECT_TRUE(callService(name, *service)) << name; })) {
    return {};
  }
  return service->response;
}

RegisterResponse Client::registerUntil(
    const std::function<bool(const RegistrationResult&)>& wanted) {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kDeadline);
  RegisterResponse response;
  do {
    response = callRegister();
    if (wanted(response.result)) return response;
    ros::WallDuration(0.01).sleep();
  } while (ros::WallTime::now() < end);
  ADD_FAILURE() << "no registration as wanted; the last said: " << response.result.message;
  return response;
}

RegisterResponse Client::sendAndRegister(const Eigen::Isometry3d& T_camera_organ) {
  const ros::Time stamp = ros::Time::now();
  sendCloud(seenCloud(T_camera_organ, stamp));
  registerUntil([&](const auto& result) {
    return result.header.stamp == stamp && result.preoperative_frame == kOrganFrame;
  });
  return callRegister(requestFrom(T_camera_organ));
}

bool Client::waitUntil(const std::function<bool()>& condition) {
  std::unique_lock lock(mutex_);
  return received_.wait_for(lock, std::chrono::duration<double>(kDeadline), condition);
}

void Client::look(const std::function<void()>& at) {
  const std::lock_guard lock(mutex_);
  at();
}

RegistrationResult Client::waitForResult(
    const std::function<bool(const RegistrationResult&)>& wanted) {
  RegistrationResult found;
  const bool came = waitUntil([&] {
    for (const auto& result : results) {
      if (!wanted(result)) continue;
      found = result;
      return true;
    }
    return false;
  });
  EXPECT_TRUE(came) << "no result as wanted among " << results.size();
  return found;
}

Eigen::Isometry3d truePose() {
  return Eigen::Translation3d(0.02, -0.01, 0.5) *
         Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.6, 0.0, 0.8));
}

sensor_msgs::PointCloud2 seenCloud(const Eigen::Isometry3d& T_camera_organ, ros::Time stamp) {
  const Points points = (T_camera_organ * organ(2000).cast<double>()).cast<float>();
  const float middle = points.row(2).mean();
  Points seen(3, points.cols());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (points(2, i) < middle) seen.col(count++) = points.col(i);
  }
  return message(Points(seen.leftCols(count)), kCameraFrame, stamp);
}

sensor_msgs::PointCloud2 organCloud() { return message(organ(), kOrganFrame, ros::Time(1.0)); }

RegisterRequest requestFrom(const Eigen::Isometry3d& T_camera_organ) {
  RegisterRequest request;
  request.use_initial_guess = true;
  request.initial_guess.header.frame_id = kCameraFrame;
  request.initial_guess.pose = tf2::toMsg(T_camera_organ);
  return request;
}

RegisterRequest requestWith(const sensor_msgs::PointCloud2& organ,
                            const sensor_msgs::PointCloud2& seen) {
  RegisterRequest request = requestFrom(truePose());
  request.preoperative = organ;
  request.intraoperative = seen;
  return request;
}

Points pointsOf(const sensor_msgs::PointCloud2& cloud) {
  return fromMessage(cloud, "received").cloud.points;
}

int fieldIndex(const sensor_msgs::PointCloud2& cloud, const std::string& field) {
  for (const auto& known : cloud.fields) {
    if (known.name != field) continue;
    EXPECT_EQ(known.datatype, sensor_msgs::PointField::FLOAT32);
    return static_cast<int>(known.offset / sizeof(float));
  }
  return -1;
}

Eigen::RowVectorXf valuesOf(const sensor_msgs::PointCloud2& cloud, const std::string& field) {
  const int index = fieldIndex(cloud, field);
  EXPECT_GE(index, 0) << "there is no field " << field;
  if (index < 0) return {};
  const auto* numbers = reinterpret_cast<const float*>(cloud.data.data());
  const auto rows = static_cast<Eigen::Index>(cloud.point_step / sizeof(float));
  return Eigen::Map<const Eigen::MatrixXf>(numbers, rows, cloud.width).row(index);
}

Eigen::Isometry3d poseOf(const geometry_msgs::Transform& transform) {
  return tf2::transformToEigen(transform);
}

}  // namespace unirit::test
