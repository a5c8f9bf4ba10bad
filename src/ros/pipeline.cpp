// SPDX-License-Identifier: BSD-3-Clause
#include "pipeline.hpp"

#include <chrono>
#include <cmath>
#include <exception>
#include <sstream>
#include <tuple>
#include <utility>

#include "conversions.hpp"
#include "names.hpp"
#include "refusal.hpp"
#include "result_message.hpp"
#include "unirit/plausibility.hpp"

namespace unirit {
namespace {

void requireFrame(const std::string& frame, const std::string& name) {
  if (frame.empty()) throw Refusal(Status::kInvalidInput, name + " names no frame");
}

void requireCloud(const sensor_msgs::PointCloud2ConstPtr& cloud, const std::string& name) {
  if (!cloud) throw Refusal(Status::kInvalidInput, name + " has not been received yet");
  requireFrame(cloud->header.frame_id, name);
}

void requireStamp(ros::Time stamp) {
  if (!stamp.isZero()) return;
  throw Refusal(Status::kInvalidInput, std::string(names::kIntraoperativeCloud) + " has no stamp");
}

/// The age is noted as a check, whether it passes or not.
void requireRecent(ros::Time stamp, ros::Time now, double limit, RegistrationResult& result) {
  const double age = (now - stamp).toSec();
  Check check;
  check.name = "age of the cloud [s]";
  check.value = std::abs(age);
  check.limit = limit;
  check.passed = check.value <= limit;
  result.checks.push_back(check);
  if (check.passed) return;
  std::ostringstream sentence;
  sentence << names::kIntraoperativeCloud << "'s stamp lies " << std::abs(age) << " s in the "
           << (age > 0.0 ? "past" : "future") << ", the limit (stale_after) is " << limit << " s";
  throw Refusal(Status::kInvalidInput, sentence.str());
}

double millisecondsSince(std::chrono::steady_clock::time_point start) {
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - start;
  return elapsed.count();
}

}  // namespace

Pipeline::Pipeline(const Parameters& parameters, TfBridge& bridge)
    : settings_(parameters.node), bridge_(bridge) {
  for (const auto& fault : parameters.faults) fault_ += (fault_.empty() ? "" : "; ") + fault;
  if (!fault_.empty()) return;
  try {
    const auto weights = std::make_shared<const Weights>(readWeights(settings_.weights));
    weights_sha256_ = weights->sha256;
    registrar_ = std::make_unique<Registrar>(weights, parameters.registration);
    settings_sha256_ = sha256(registrar_->settings());
  } catch (const std::exception& error) {
    fault_ = error.what();
  }
}

Attempt Pipeline::run(const Job& job, const Attempt* accepted,
                      const PlausibilitySettings& thresholds, ros::Time now) {
  Attempt attempt;
  RegistrationResult& result = attempt.result;
  result.id = ++attempts_;
  result.transform.rotation.w = 1.0;
  if (job.preoperative) result.preoperative_frame = job.preoperative->header.frame_id;
  if (job.intraoperative) result.header = job.intraoperative->header;
  try {
    if (!job.detached && job.guess) guess_ = job.guess;
    if (!fault_.empty()) throw Refusal(Status::kFailed, fault_);
    applyThresholds(thresholds);
    result.weights_sha256 = weights_sha256_;
    result.settings_sha256 = settings_sha256_;
    this->attempt(job, accepted, now, attempt);
  } catch (const Refusal& refusal) {
    result.status = static_cast<std::uint8_t>(refusal.status());
    result.message = refusal.what();
  } catch (const std::exception& error) {
    result.status = RegistrationResult::FAILED;
    result.message = std::string("internal error: ") + error.what();
  }
  return attempt;
}

void Pipeline::applyThresholds(const PlausibilitySettings& thresholds) {
  RegistrationSettings settings = registrar_->settings();
  settings.plausibility = thresholds;
  const std::string hash = sha256(settings);
  if (hash == settings_sha256_) return;
  registrar_->setSettings(settings);
  settings_sha256_ = hash;
}

void Pipeline::checkMessages(const Job& job, ros::Time now, RegistrationResult& result) const {
  requireCloud(job.preoperative, names::kPreoperativeCloud);
  requireCloud(job.intraoperative, names::kIntraoperativeCloud);
  const std::string& frame = job.preoperative->header.frame_id;
  if (frame == job.intraoperative->header.frame_id) {
    throw Refusal(Status::kInvalidInput, "both clouds are in frame '" + frame +
                                             "': the pre-operative cloud needs a frame of its own");
  }
  // The age of a caller's own cloud says nothing, nor that of a cloud that waits in a replay
  if (job.detached) return;
  const ros::Time stamp = job.intraoperative->header.stamp;
  requireStamp(stamp);
  if (!settings_.every_cloud) requireRecent(stamp, now, settings_.stale_after, result);
}

/// T_cloud_fixed at the cloud's stamp. A detached job needs it only where it starts from
/// initial_pose.
Eigen::Isometry3d Pipeline::placeCloud(const Job& job, const std::string& fixed_frame) {
  const std_msgs::Header& header = job.intraoperative->header;
  const std::string& organ_frame = job.preoperative->header.frame_id;
  if (job.detached && (job.guess || !settings_.initial_pose)) return Eigen::Isometry3d::Identity();
  if (!job.detached && settings_.publish_tf) {
    const auto& [parent, child] = settings_.invert_tf ? std::tie(organ_frame, fixed_frame)
                                                      : std::tie(fixed_frame, organ_frame);
    bridge_.claimEdge(parent, child);
  }
  return bridge_.lookUp(header.frame_id, fixed_frame, header.stamp, settings_.tf_timeout);
}

/// Where the sensor stood, in the cloud's frame, at its stamp. Drivers publish clouds in the frame
/// of their camera.
std::optional<Eigen::Vector3f> Pipeline::placeSensor(const std_msgs::Header& cloud) const {
  if (settings_.sensor_frame == names::kNoSensor) return std::nullopt;
  if (settings_.sensor_frame.empty()) return Eigen::Vector3f::Zero();
  const Eigen::Isometry3d T_cloud_sensor =
      bridge_.lookUp(cloud.frame_id, settings_.sensor_frame, cloud.stamp, settings_.tf_timeout);
  return T_cloud_sensor.translation().cast<float>();
}

void Pipeline::attempt(const Job& job, const Attempt* accepted, ros::Time now, Attempt& attempt) {
  checkMessages(job, now, attempt.result);
  const std_msgs::Header& header = job.intraoperative->header;

  // Messages to clouds
  auto started = std::chrono::steady_clock::now();
  const ReceivedCloud organ = fromMessage(*job.preoperative, names::kPreoperativeCloud);
  ReceivedCloud seen = fromMessage(*job.intraoperative, names::kIntraoperativeCloud);
  const double conversion = millisecondsSince(started);

  // Where to start
  attempt.fixed_frame = settings_.fixed_frame.empty() ? header.frame_id : settings_.fixed_frame;
  const Eigen::Isometry3d T_cloud_fixed = placeCloud(job, attempt.fixed_frame);
  if (accepted != nullptr && accepted->fixed_frame != attempt.fixed_frame) accepted = nullptr;
  const auto guess = job.detached ? job.guess : std::exchange(guess_, std::nullopt);
  seen.cloud.viewpoint = placeSensor(header);
  const Start start = chooseStart(job, guess, accepted, T_cloud_fixed);
  attempt.result.start = start.name;

  // Preprocessing and registration; a cloud that is at fault does not use up the guess
  RawCloud raw{std::move(seen.cloud), seen.total, placeRegion(header), start.place()};
  started = std::chrono::steady_clock::now();
  const Preprocessed ready = preprocess(std::move(raw), organ.cloud.points, registrar_->settings());
  const double preprocessing = millisecondsSince(started);
  fillIn(ready.stages, attempt.result);
  Registration registration = registerReady(organ.cloud, ready, start);
  if (registration.status == Status::kInvalidInput && !job.detached) guess_ = guess;
  registration.stages.insert(registration.stages.begin(),
                             {{"conversion", conversion}, {"preprocessing", preprocessing}});
  attempt.T_fixed_preoperative =
      T_cloud_fixed.inverse() * registration.T_intraoperative_preoperative;
  attempt.T_fixed_expected = T_cloud_fixed.inverse() * registration.next_guess;
  attempt.expected_fit = registration.next_fit;

  // A guess replaces the accepted pose, so a jump from there is what is wanted
  const PlausibilitySettings& thresholds = registrar_->settings().plausibility;
  if (accepted != nullptr && start.name != names::kStartGuess && registration.deformation) {
    applyChecks(checkJump(attempt.T_fixed_preoperative, accepted->T_fixed_preoperative,
                          centroid(organ.cloud.points).cast<double>(), thresholds),
                registration);
  }

  fillIn(registration, thresholds.inlier_tolerance, attempt.result);
  attempt.deformation = registration.deformation;
  if (!registration.deformation) return;
  const Deformation& deformation = *registration.deformation;
  attempt.deformed =
      toMessage(deformation.movedSurface(),
                {{names::kDisplacementField, deformation.displacements().colwise().norm()},
                 {names::kConfidenceField, deformation.confidence()}},
                organ, header);
  attempt.rigid = toMessage(deformation.moveRigidly(organ.cloud.points), {}, organ, header);
}

/// What the cloud is cropped to, at its stamp.
std::optional<Region> Pipeline::placeRegion(const std_msgs::Header& cloud) const {
  if (!settings_.region) return std::nullopt;
  const std::string& frame =
      settings_.region_frame.empty() ? cloud.frame_id : settings_.region_frame;
  return Region{*settings_.region,
                bridge_.lookUp(frame, cloud.frame_id, cloud.stamp, settings_.tf_timeout)};
}

Registration Pipeline::registerReady(const PointCloud& organ, const Preprocessed& ready,
                                     const Start& start) {
  if (!ready.fault) {
    return registrar_->registerClouds(
        organ, ready.cloud, start.guess ? *start.guess : alignCentroids(organ, ready.cloud),
        start.earlier ? &*start.earlier : nullptr);
  }
  Registration registration;
  registration.status = Status::kInvalidInput;
  registration.message = *ready.fault;
  return registration;
}

std::optional<Eigen::Isometry3d> Pipeline::Start::place() const {
  if (earlier) return earlier->T_intraoperative_preoperative;
  return guess;
}

Pipeline::Start Pipeline::chooseStart(const Job& job,
                                      const std::optional<geometry_msgs::PoseStamped>& guess,
                                      const Attempt* accepted,
                                      const Eigen::Isometry3d& T_cloud_fixed) const {
  if (guess) {
    return {names::kStartGuess,
            placeGuess(*guess, job.preoperative->header.frame_id, job.intraoperative->header)};
  }
  if (accepted != nullptr) {
    return {names::kStartAccepted, T_cloud_fixed * accepted->T_fixed_expected,
            Earlier{T_cloud_fixed * accepted->T_fixed_preoperative, accepted->deformation,
                    accepted->expected_fit}};
  }
  if (settings_.initial_pose) return {names::kStartPose, T_cloud_fixed * *settings_.initial_pose};
  if (settings_.initial_alignment == "none") {
    throw Refusal(Status::kInvalidInput,
                  "there is no initial guess, no accepted registration and no initial_pose to "
                  "start from, and initial_alignment is none");
  }
  return {names::kStartCentroids, std::nullopt};
}

Eigen::Isometry3d Pipeline::placeGuess(const geometry_msgs::PoseStamped& guess,
                                       const std::string& preoperative_frame,
                                       const std_msgs::Header& cloud) const {
  requireFrame(guess.header.frame_id, "the initial guess");
  if (guess.header.frame_id == preoperative_frame) {
    throw Refusal(Status::kInvalidInput, "the initial guess is given in the pre-operative frame '" +
                                             preoperative_frame + "', whose pose is sought");
  }
  const Eigen::Isometry3d T_guess_preoperative = fromMessage(guess.pose, "the initial guess");
  return bridge_.lookUp(cloud.frame_id, guess.header.frame_id, cloud.stamp, settings_.tf_timeout) *
         T_guess_preoperative;
}

}  // namespace unirit
