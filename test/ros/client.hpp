// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_msgs/TFMessage.h>
#include <unirit/DeformPoints.h>
#include <unirit/Register.h>

#include <Eigen/Geometry>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "test_clouds.hpp"

namespace unirit::test {

inline constexpr double kDeadline = 30.0;  // of every wait [s]; generous for a loaded machine

/// Calls a service over a connection that this end closes. Where the server does, as with
/// ros::service::call, roscpp may see it closed before it has read the answer, which is lost
/// (github.com/ros/ros_comm/issues/1976).
template <class Service>
bool callService(const std::string& name, Service& service) {
  constexpr bool kPersistent = true;
  return ros::NodeHandle().serviceClient<Service>(name, kPersistent).call(service);
}

/// Everything a registration node is told and says. Waits end at the deadline with a test failure.
/// Needs a spinner that runs beside it.
class Client {
 public:
  /// `node`: its absolute name. Waits until the node is there.
  explicit Client(const std::string& node);

  void sendOrgan(const sensor_msgs::PointCloud2& cloud) { organ_.publish(cloud); }
  void sendCloud(const sensor_msgs::PointCloud2& cloud) { cloud_.publish(cloud); }
  void sendGuess(const std::string& frame, const Eigen::Isometry3d& pose);

  /// Calls the service; a call that fails or is not answered is a test failure.
  RegisterResponse callRegister(const RegisterRequest& request = {});
  DeformPointsResponse callDeformPoints(const std::string& frame, const Points& points);

  /// Calls register until its result is as wanted; messages on topics need time to arrive.
  RegisterResponse registerUntil(const std::function<bool(const RegistrationResult&)>& wanted);

  /// Sends a new cloud of the organ at this pose and registers it, with a start, as soon as it has
  /// arrived.
  RegisterResponse sendAndRegister(const Eigen::Isometry3d& T_camera_organ);

  /// The first result on the topic that is as wanted, among those already here and to come.
  RegistrationResult waitForResult(const std::function<bool(const RegistrationResult&)>& wanted);

  /// Waits until a condition on what was received holds; it is called with the lock held.
  bool waitUntil(const std::function<bool()>& condition);

  /// Looks at what was received, with the lock held.
  void look(const std::function<void()>& at);

  /// What was received so far, for conditions and looks; results and transforms in order, clouds
  /// the latest.
  std::vector<RegistrationResult> results;
  std::vector<geometry_msgs::TransformStamped> transforms;
  sensor_msgs::PointCloud2 deformed, rigid, refused;

 private:
  template <class Message, class Store>
  ros::Subscriber listen(const std::string& topic, Store store);

  std::mutex mutex_;
  std::condition_variable received_;
  ros::NodeHandle nh_, global_;
  ros::Publisher organ_, cloud_, guess_;
  std::vector<ros::Subscriber> subscribers_;
};

/// Runs a call in a thread of its own and waits for its end; a test failure where it takes longer
/// than the deadline.
bool finishes(const std::function<void()>& call);

/// T_camera_organ of the tests.
Eigen::Isometry3d truePose();

/// What a camera sees of the organ at a pose: the half nearer to it, in kCameraFrame.
sensor_msgs::PointCloud2 seenCloud(const Eigen::Isometry3d& T_camera_organ, ros::Time stamp);

/// The organ as the pre-operative cloud, in kOrganFrame.
sensor_msgs::PointCloud2 organCloud();

/// A request for the latest clouds with this start; a request of its own clouds.
RegisterRequest requestFrom(const Eigen::Isometry3d& T_camera_organ);
RegisterRequest requestWith(const sensor_msgs::PointCloud2& organ,
                            const sensor_msgs::PointCloud2& seen);

/// x y z of a cloud, as received.
Points pointsOf(const sensor_msgs::PointCloud2& cloud);

/// Place of a field in each point of a cloud as the node publishes it, counted in floats; -1: it
/// has none of that name. And its values.
int fieldIndex(const sensor_msgs::PointCloud2& cloud, const std::string& field);
Eigen::RowVectorXf valuesOf(const sensor_msgs::PointCloud2& cloud, const std::string& field);

Eigen::Isometry3d poseOf(const geometry_msgs::Transform& transform);

}  // namespace unirit::test
