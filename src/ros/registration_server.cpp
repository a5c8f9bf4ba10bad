// SPDX-License-Identifier: BSD-3-Clause
#include "registration_server.hpp"

#include <cmath>
#include <exception>
#include <future>
#include <utility>

#include "names.hpp"
#include "refusal.hpp"

namespace unirit {
namespace {

constexpr double kHistory = 10.0;               // of /tf [s]
constexpr double kReplayHistory = 24 * 3600.0;  // clouds may wait long for their turn [s]
constexpr double kClockTolerance = 0.1;         // a clock set back by less is being adjusted [s]

/// No exception may leave a callback: one would end the whole nodelet manager.
template <class Work>
void guarded(const char* what, Work&& work) {
  try {
    work();
  } catch (const std::exception& error) {
    ROS_ERROR("%s: %s", what, error.what());
  }
}

ros::NodeHandle onQueue(ros::NodeHandle nh, ros::CallbackQueue& queue) {
  nh.setCallbackQueue(&queue);
  return nh;
}

Eigen::Vector3f toPoint(const geometry_msgs::Point& point, std::size_t index) {
  const Eigen::Vector3f converted = Eigen::Vector3d(point.x, point.y, point.z).cast<float>();
  if (!converted.allFinite()) {
    throw Refusal(Status::kInvalidInput, "point " + std::to_string(index) + " is not finite");
  }
  return converted;
}

/// The request's points moved by the accepted registration; throws Refusal where there is none.
void deformPoints(const DeformPointsRequest& request, const Acceptance::State& state, bool fresh,
                  DeformPointsResponse& response) {
  if (!state.attempt) throw Refusal(Status::kRefused, "no registration has been accepted");
  const RegistrationResult& result = state.attempt->result;
  response.registration_id = result.id;
  response.header = result.header;
  response.age = ros::Time::now() - result.header.stamp;
  if (!fresh) throw Refusal(Status::kStale, "the accepted registration has outlived stale_after");
  if (request.header.frame_id != result.preoperative_frame) {
    throw Refusal(Status::kInvalidInput, "the points are in frame '" + request.header.frame_id +
                                             "' instead of the pre-operative frame '" +
                                             result.preoperative_frame + "'");
  }
  Points points(3, static_cast<Eigen::Index>(request.points.size()));
  for (std::size_t i = 0; i < request.points.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = toPoint(request.points[i], i);
  }
  const Deformation& deformation = *state.attempt->deformation;
  const Points moved = deformation.move(points);
  response.points.resize(request.points.size());
  for (std::size_t i = 0; i < response.points.size(); ++i) {
    const auto point = moved.col(static_cast<Eigen::Index>(i));
    response.points[i].x = point.x();
    response.points[i].y = point.y();
    response.points[i].z = point.z();
  }
  const Eigen::RowVectorXf confidence = deformation.confidence(points);
  response.confidence.assign(confidence.data(), confidence.data() + confidence.size());
  response.message = "moved by registration " + std::to_string(result.id);
}

}  // namespace

RegistrationServer::RegistrationServer(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
    : nh_(onQueue(nh, callbacks_queue_)),
      private_nh_(onQueue(private_nh, callbacks_queue_)),
      register_nh_(onQueue(private_nh, register_queue_)),
      parameters_(readParameters(private_nh_)),
      diagnostics_(nh_, private_nh_),
      bridge_(nh_, parameters_.node.every_cloud ? kReplayHistory : kHistory),
      acceptance_(private_nh_, parameters_.node, bridge_, diagnostics_),
      mailbox_(parameters_.node.every_cloud),
      thresholds_(parameters_.registration.plausibility),
      callbacks_spinner_(1, &callbacks_queue_),
      register_spinner_(1, &register_queue_) {
  for (const std::string& warning : parameters_.warnings) {
    ROS_WARN("%s", warning.c_str());
    diagnostics_.noteWarning(warning);
  }
  connect();
  callbacks_spinner_.start();
  register_spinner_.start();
  worker_ = std::thread([this] { work(); });
}

RegistrationServer::~RegistrationServer() {
  bridge_.stop();
  mailbox_.stop();
  worker_.join();
  register_spinner_.stop();
  callbacks_spinner_.stop();
}

void RegistrationServer::connect() {
  const ros::NodeHandle thresholds_nh(private_nh_, names::kThresholds);
  reconfigure_ = std::make_unique<dynamic_reconfigure::Server<UniritConfig>>(reconfigure_mutex_,
                                                                             thresholds_nh);
  reconfigure_->setCallback([this](auto& config, auto) { onThresholds(config); });

  const auto hints = ros::TransportHints().tcpNoDelay();
  const unsigned clouds = parameters_.node.every_cloud ? 0 : 1;  // 0: none is dropped
  preoperative_ = private_nh_.subscribe(names::kPreoperative, 1,
                                        &RegistrationServer::onPreoperative, this, hints);
  intraoperative_ = private_nh_.subscribe(names::kIntraoperative, clouds,
                                          &RegistrationServer::onIntraoperative, this, hints);
  initial_guess_ = private_nh_.subscribe(names::kInitialGuess, 1,
                                         &RegistrationServer::onInitialGuess, this, hints);
  deform_points_ =
      private_nh_.advertiseService(names::kDeformPoints, &RegistrationServer::onDeformPoints, this);
  register_ =
      register_nh_.advertiseService(names::kRegister, &RegistrationServer::onRegister, this);
  timer_ = private_nh_.createWallTimer(ros::WallDuration(1.0 / parameters_.node.tf_rate),
                                       [this](const ros::WallTimerEvent&) { onTimer(); });
}

void RegistrationServer::onPreoperative(const sensor_msgs::PointCloud2ConstPtr& cloud) {
  guarded(names::kPreoperative, [&] {
    diagnostics_.notePreoperative(cloud->header.stamp);
    if (mailbox_.putPreoperative(cloud)) acceptance_.reset();
  });
}

void RegistrationServer::onIntraoperative(const sensor_msgs::PointCloud2ConstPtr& cloud) {
  guarded(names::kIntraoperative, [&] {
    noticeTurnedBackClock();
    const bool dropped = mailbox_.putIntraoperative(cloud, parameters_.node.auto_register);
    diagnostics_.noteIntraoperative(cloud->header.stamp, dropped);
  });
}

void RegistrationServer::onInitialGuess(
    const geometry_msgs::PoseWithCovarianceStampedConstPtr& guess) {
  guarded(names::kInitialGuess, [&] {
    geometry_msgs::PoseStamped pose;
    pose.header = guess->header;
    pose.pose = guess->pose.pose;
    mailbox_.putGuess(pose);
  });
}

void RegistrationServer::onThresholds(const UniritConfig& config) {
  const std::lock_guard lock(mutex_);
  thresholds_ = fromConfig(config);
}

bool RegistrationServer::onRegister(RegisterRequest& request, RegisterResponse& response) {
  try {
    response = mailbox_.putRequest(request).get();
  } catch (const std::future_error&) {
    response.result.status = RegistrationResult::FAILED;
    response.result.message =
        "the request was dropped: the node shuts down or the clock was "
        "turned back";
  } catch (const std::exception& error) {
    response.result.status = RegistrationResult::FAILED;
    response.result.message = std::string("internal error: ") + error.what();
  }
  return true;
}

bool RegistrationServer::onDeformPoints(DeformPointsRequest& request,
                                        DeformPointsResponse& response) {
  try {
    const Acceptance::State state = acceptance_.state();
    const bool fresh = acceptance_.freshAt(ros::Time::now()) == state.attempt;
    deformPoints(request, state, fresh, response);
  } catch (const Refusal& refusal) {
    response.status = static_cast<std::uint8_t>(refusal.status());
    response.message = refusal.what();
  } catch (const std::exception& error) {
    response.status = RegistrationResult::FAILED;
    response.message = std::string("internal error: ") + error.what();
  }
  return true;
}

void RegistrationServer::onTimer() {
  guarded("timer", [&] {
    noticeTurnedBackClock();
    // In a replay the clock runs ahead of the clouds that wait; the worker judges by their stamps
    const ros::Time now = ros::Time::now();
    if (!parameters_.node.every_cloud || mailbox_.idle()) acceptance_.withdrawIfStale(now);
    acceptance_.broadcast(now);
    diagnostics_.update();
  });
}

void RegistrationServer::noticeTurnedBackClock() {
  const ros::Time now = ros::Time::now();
  const std::lock_guard lock(mutex_);
  const double step = (now - latest_now_).toSec();
  latest_now_ = now;
  if (step >= -kClockTolerance) return;
  ROS_WARN("the clock was turned back by %.1f s: starting anew", -step);
  mailbox_.clear();
  bridge_.reset();
  acceptance_.reset();
}

void RegistrationServer::work() {
  Pipeline pipeline(parameters_, bridge_);
  if (!pipeline.fault().empty()) {
    ROS_ERROR("nothing can be registered: %s", pipeline.fault().c_str());
    diagnostics_.noteFault(pipeline.fault());
  }
  while (auto job = mailbox_.take()) {
    guarded("registration", [&] { perform(pipeline, *job); });
  }
}

void RegistrationServer::perform(Pipeline& pipeline, Job& job) {
  // In a replay, clouds are judged by their own time, so that its speed changes nothing
  const ros::Time now = ros::Time::now();
  const bool by_stamp = parameters_.node.every_cloud && !job.detached && job.intraoperative &&
                        !job.intraoperative->header.stamp.isZero();
  const ros::Time at = by_stamp ? job.intraoperative->header.stamp : now;
  acceptance_.withdrawIfStale(at);
  const unsigned voided = acceptance_.state().voided;
  if (std::exchange(voided_, voided) != voided) pipeline.forgetGuess();
  const auto accepted = job.detached ? nullptr : acceptance_.freshAt(at);
  PlausibilitySettings thresholds;
  {
    const std::lock_guard lock(mutex_);
    thresholds = thresholds_;
  }
  auto attempt = std::make_shared<Attempt>(pipeline.run(job, accepted.get(), thresholds, now));
  if (!job.detached && !acceptance_.publish(attempt, job.intraoperative, voided)) {
    attempt->result.status = RegistrationResult::FAILED;
    attempt->result.message =
        "another organ was received, or the clock was turned back, while "
        "the registration ran";
  }
  if (!job.answer) return;
  RegisterResponse response;
  response.result = attempt->result;
  response.deformed = attempt->deformed;
  job.answer->set_value(response);
}

}  // namespace unirit
