// SPDX-License-Identifier: BSD-3-Clause
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

#include "conversions.hpp"
#include "demo_report.hpp"
#include "demo_scene.hpp"
#include "names.hpp"
#include "triangulation.hpp"
#include "unirit/io/surface_io.hpp"
#include "unirit/metrics.hpp"
#include "unirit/normals.hpp"
#include "unirit/point_cloud.hpp"
#include "unirit/settings.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

constexpr char kWorldFrame[] = "world";
constexpr char kCameraFrame[] = "camera_optical";
constexpr char kPreoperativeFrame[] = "preoperative";
constexpr double kMillimetre = 0.001;  // unit of organ files [m]

SceneSettings readSceneSettings(const ros::NodeHandle& nh) {
  SceneSettings scene;
  nh.getParam("camera/width", scene.camera.width);
  nh.getParam("camera/height", scene.camera.height);
  nh.getParam("camera/horizontal_field", scene.camera.horizontal_field);
  nh.getParam("camera/depth_noise", scene.camera.depth_noise);
  nh.getParam("camera/outlier_fraction", scene.camera.outlier_fraction);
  nh.getParam("camera/distance", scene.camera_distance);
  nh.getParam("motion/breathing_period", scene.motion.breathing_period);
  nh.getParam("motion/breathing_amplitude", scene.motion.breathing_amplitude);
  nh.getParam("motion/bulge_amplitude", scene.motion.bulge_amplitude);
  nh.getParam("motion/deformation", scene.motion.deformation);
  nh.getParam("motion/rigid_rotation", scene.motion.rigid_rotation);
  nh.getParam("motion/rigid_translation", scene.motion.rigid_translation);
  nh.getParam("guess_rotation", scene.guess_rotation);
  nh.getParam("guess_translation", scene.guess_translation);
  scene.seed = static_cast<std::uint64_t>(nh.param("seed", 1));
  return scene;
}

void requireOrgan(const Surface& organ, const std::string& file) {
  const double size = extent(organ.vertices.points);
  const PlausibilitySettings limits;
  if (size >= limits.min_organ_extent && size <= limits.max_organ_extent) return;
  std::ostringstream sentence;
  sentence << file << " holds an organ of " << size / kMillimetre
           << " mm: is it in another unit than millimetres?";
  throw std::runtime_error(sentence.str());
}

/// A mesh with the normals of its faces; where the file has no faces, these are made, and the
/// normals are the file's.
Surface readOrgan(const std::string& file) {
  Surface organ = readSurface(file, kMillimetre).surface;
  requireOrgan(organ, file);
  if (organ.faces.cols() == 0) {
    organ.faces = triangulate(organ.vertices.points);
    return organ;
  }
  turnFacesOutwards(organ);
  organ.vertices.normals = vertexNormals(organ);
  return organ;
}

/// The organ of a file, or the phantom of that name where none is given.
Surface loadOrgan(const std::string& file, const std::string& phantom, int seed) {
  if (!file.empty()) return readOrgan(file);
  return makePhantom(phantom, static_cast<std::uint64_t>(seed));
}

std_msgs::Header header(const std::string& frame, ros::Time stamp) {
  std_msgs::Header made;
  made.frame_id = frame;
  made.stamp = stamp;
  return made;
}

/// Plays the operating room to a registration node and compares what it answers with the truth.
class Demo {
 public:
  Demo(ros::NodeHandle nh, const Surface& organ);

  /// Whether all went well: every view was answered in time, and some registration succeeded.
  bool run();

 private:
  void publishScene(const Surface& organ);
  void publishGuess();
  bool showNextView();
  TrueErrors assess();
  void report(const RegistrationResult& result, const TrueErrors& errors);
  bool waitFor(const std::function<bool()>& condition) const;

  ros::NodeHandle nh_;
  DemoScene scene_;
  Points shown_;  // the organ as last shown, in the camera's frame
  View view_;
  Tally tally_;
  bool accepted_ = false;
  int views_ = 0;
  const double period_;    // between views, at least [s]
  const double deadline_;  // for an answer [s]

  // The latest answers, null after a new view until they are about it
  RegistrationResultConstPtr result_;
  sensor_msgs::PointCloud2ConstPtr deformed_, rigid_;

  tf2_ros::StaticTransformBroadcaster transforms_;
  ros::Publisher preoperative_, intraoperative_, guess_, status_;
  ros::Subscriber results_, deformed_clouds_, rigid_clouds_;
};

Demo::Demo(ros::NodeHandle nh, const Surface& organ)
    : nh_(nh),
      scene_(organ, readSceneSettings(nh)),
      period_(nh.param("period", 0.5)),
      deadline_(nh.param("deadline", 60.0)) {
  using sensor_msgs::PointCloud2;
  preoperative_ = nh_.advertise<PointCloud2>(names::kPreoperative, 1, true);
  intraoperative_ = nh_.advertise<PointCloud2>(names::kIntraoperative, 1);
  guess_ = nh_.advertise<geometry_msgs::PoseWithCovarianceStamped>(names::kInitialGuess, 1);
  status_ = nh_.advertise<visualization_msgs::Marker>("status", 1, true);
  results_ = nh_.subscribe<RegistrationResult>(
      names::kResult, 10, [this](const RegistrationResultConstPtr& result) { result_ = result; });
  deformed_clouds_ = nh_.subscribe<PointCloud2>(names::kDeformed, 1,
                                                [this](const auto& cloud) { deformed_ = cloud; });
  rigid_clouds_ =
      nh_.subscribe<PointCloud2>(names::kRigid, 1, [this](const auto& cloud) { rigid_ = cloud; });
  publishScene(organ);
}

void Demo::publishScene(const Surface& organ) {
  const ros::Time now = ros::Time::now();
  geometry_msgs::TransformStamped camera = tf2::eigenToTransform(scene_.cameraPose());
  camera.header = header(kWorldFrame, now);
  camera.child_frame_id = kCameraFrame;
  transforms_.sendTransform(camera);
  preoperative_.publish(toMessage(organ.vertices, header(kPreoperativeFrame, now)));
  shown_ =
      (scene_.cameraPose().inverse() * scene_.roughPose() * organ.vertices.points.cast<double>())
          .cast<float>();
}

void Demo::publishGuess() {
  geometry_msgs::PoseWithCovarianceStamped guess;
  guess.header = header(kWorldFrame, ros::Time::now());
  guess.pose.pose = tf2::toMsg(scene_.roughPose());
  guess_.publish(guess);
}

bool Demo::waitFor(const std::function<bool()>& condition) const {
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(deadline_);
  while (ros::ok() && !condition() && ros::WallTime::now() < end) {
    ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.05));
  }
  return condition();
}

bool Demo::run() {
  const int wanted = nh_.param("registrations", 0);
  if (!waitFor([this] {
        return intraoperative_.getNumSubscribers() > 0 && guess_.getNumSubscribers() > 0 &&
               results_.getNumPublishers() > 0;
      })) {
    if (ros::ok()) std::fprintf(stderr, "demo: no registration node within %g s\n", deadline_);
    return false;
  }
  while (ros::ok() && (wanted == 0 || tally_.registrations < wanted)) {
    if (!showNextView()) return false;
  }
  std::printf("demo: %s\n", describe(tally_).c_str());
  return tally_.succeeded > 0;
}

/// Publishes a view and waits for what the registration makes of it.
bool Demo::showNextView() {
  // Without an accepted registration somebody points at the organ first; then time to get there
  if (!accepted_) publishGuess();
  const ros::WallTime next = ros::WallTime::now() + ros::WallDuration(period_);
  view_ = scene_.viewAt(period_ * views_++);
  waitFor([&] { return ros::WallTime::now() >= next; });

  const ros::Time stamp = ros::Time::now();
  const auto answers = [&](const auto& message) {
    return message && message->header.stamp == stamp;
  };
  intraoperative_.publish(toMessage(view_.cloud.points, header(kCameraFrame, stamp)));
  const bool answered = waitFor([&] {
    if (!answers(result_)) return false;
    return result_->status != RegistrationResult::SUCCEEDED ||
           (answers(deformed_) && answers(rigid_));
  });
  if (!answered) {
    if (ros::ok()) std::fprintf(stderr, "demo: no answer within %g s\n", deadline_);
    return false;
  }
  if (result_->status == RegistrationResult::SUCCEEDED) accepted_ = true;
  if (result_->status == RegistrationResult::STALE) accepted_ = false;
  report(*result_, assess());
  return true;
}

TrueErrors Demo::assess() {
  TrueErrors errors;
  errors.before = rootMeanSquareDistance(shown_, view_.truth);
  if (result_->status != RegistrationResult::SUCCEEDED) return errors;
  shown_ = fromMessage(*deformed_, "deformed").cloud.points;
  errors.deformed = rootMeanSquareDistance(shown_, view_.truth);
  errors.rigid = rootMeanSquareDistance(fromMessage(*rigid_, "rigid").cloud.points, view_.truth);
  return errors;
}

void Demo::report(const RegistrationResult& result, const TrueErrors& errors) {
  tally_.add(result, errors);
  std::printf("%s\n", describe(result, errors).c_str());
  std::fflush(stdout);
  visualization_msgs::Marker text = statusText(result, errors, 0.07 * scene_.organExtent());
  text.header = header(kCameraFrame, ros::Time());
  text.pose.position.y = -0.6 * scene_.organExtent();  // above the organ as the camera sees it
  text.pose.position.z = scene_.cameraDistance();
  status_.publish(text);
}

}  // namespace
}  // namespace unirit

/// A simulated operating room that shows what the registration node does, with known truth.
/// `demo_camera --check FILE PHANTOM` only says, without ROS, whether it can show this organ.
int main(int argc, char** argv) {
  try {
    if (argc == 4 && argv[1] == std::string("--check")) {
      unirit::loadOrgan(argv[2], argv[3], 1);
      return 0;
    }
    ros::init(argc, argv, "demo");
    const ros::NodeHandle nh("~");
    const unirit::Surface organ =
        unirit::loadOrgan(nh.param<std::string>("organ", ""),
                          nh.param<std::string>("phantom", "liver"), nh.param("seed", 1));
    return unirit::Demo(nh, organ).run() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "demo: %s\n", error.what());
    return 1;
  }
}
