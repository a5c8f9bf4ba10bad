// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Names of topics, services, fields and starts. Topics and services are relative to the node's
/// private namespace and can be remapped.
namespace unirit::names {

inline constexpr char kPreoperative[] = "preoperative";
inline constexpr char kIntraoperative[] = "intraoperative";
inline constexpr char kInitialGuess[] = "initial_guess";
inline constexpr char kDeformed[] = "deformed";
inline constexpr char kRigid[] = "rigid";
inline constexpr char kResult[] = "result";
inline constexpr char kRefused[] = "refused";
inline constexpr char kRegister[] = "register";
inline constexpr char kDeformPoints[] = "deform_points";
inline constexpr char kThresholds[] = "plausibility";  // namespace of the dynamic parameters

inline constexpr char kDisplacementField[] = "displacement";
inline constexpr char kConfidenceField[] = "confidence";

inline constexpr char kNoSensor[] = "none";  // in place of a sensor's frame

inline constexpr char kStartGuess[] = "initial guess";
inline constexpr char kStartAccepted[] = "accepted";
inline constexpr char kStartPose[] = "initial_pose";
inline constexpr char kStartCentroids[] = "centroids";

// How sentences call the two clouds.
inline constexpr char kPreoperativeCloud[] = "the pre-operative cloud";
inline constexpr char kIntraoperativeCloud[] = "the intra-operative cloud";

}  // namespace unirit::names
