// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>
#include <unirit/RegistrationResult.h>

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>

#include "mailbox.hpp"
#include "parameters.hpp"
#include "tf_bridge.hpp"
#include "unirit/preprocessing.hpp"
#include "unirit/registration.hpp"

namespace unirit {

/// What one job came to.
struct Attempt {
  RegistrationResult result;
  sensor_msgs::PointCloud2 deformed, rigid;        ///< empty unless succeeded or refused
  std::shared_ptr<const Deformation> deformation;  ///< null unless succeeded or refused
  std::string fixed_frame;  ///< what the pose below is in: does not move with the camera
  Eigen::Isometry3d T_fixed_preoperative = Eigen::Isometry3d::Identity();
  /// Where the next attempt expects it: Registration::next_guess.
  Eigen::Isometry3d T_fixed_expected = Eigen::Isometry3d::Identity();
  std::optional<double> expected_fit;  ///< Registration::next_fit
};

/// From a job to an attempt: checks the messages, looks up frames, chooses the start, makes the
/// cloud ready, registers and judges. Used by the worker thread alone.
class Pipeline {
 public:
  /// Reads the weights; where they or the parameters cannot be used every attempt fails with the
  /// sentence. `bridge` must outlive the pipeline.
  Pipeline(const Parameters& parameters, TfBridge& bridge);

  /// `accepted`: the fresh accepted attempt, or null. `now`: the time a cloud's age is judged by.
  /// Never throws: the result's status and sentence say what went wrong.
  Attempt run(const Job& job, const Attempt* accepted, const PlausibilitySettings& thresholds,
              ros::Time now);

  /// Why nothing can be registered, or empty.
  const std::string& fault() const { return fault_; }

  /// Drops the guess that waits: it was for another organ, or before the clock was turned back.
  void forgetGuess() { guess_.reset(); }

 private:
  struct Start {
    std::string name;
    std::optional<Eigen::Isometry3d> guess;         // nothing: from the clouds' centroids
    std::optional<Earlier> earlier = std::nullopt;  // the accepted registration

    /// Where the organ must be about, if that is known.
    std::optional<Eigen::Isometry3d> place() const;
  };

  void attempt(const Job& job, const Attempt* accepted, ros::Time now, Attempt& attempt);
  void checkMessages(const Job& job, ros::Time now, RegistrationResult& result) const;
  Eigen::Isometry3d placeCloud(const Job& job, const std::string& fixed_frame);
  std::optional<Eigen::Vector3f> placeSensor(const std_msgs::Header& cloud) const;
  std::optional<Region> placeRegion(const std_msgs::Header& cloud) const;
  Registration registerReady(const PointCloud& organ, const Preprocessed& ready,
                             const Start& start);
  Start chooseStart(const Job& job, const std::optional<geometry_msgs::PoseStamped>& guess,
                    const Attempt* accepted, const Eigen::Isometry3d& T_cloud_fixed) const;
  Eigen::Isometry3d placeGuess(const geometry_msgs::PoseStamped& guess,
                               const std::string& preoperative_frame,
                               const std_msgs::Header& cloud) const;
  void applyThresholds(const PlausibilitySettings& thresholds);

  const NodeSettings settings_;
  TfBridge& bridge_;
  std::string fault_;
  std::string weights_sha256_, settings_sha256_;
  std::unique_ptr<Registrar> registrar_;
  std::optional<geometry_msgs::PoseStamped> guess_;  // waits for a registration that can use it
  std::uint32_t attempts_ = 0;
};

}  // namespace unirit
