// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// How a target is made from a deformed organ; docs/benchmark.md describes each.
enum class Protocol { kPaired, kPermuted, kResampled, kCaseB, kPartial, kOffset, kIntraop };

const char* toString(Protocol protocol);

/// Throws std::invalid_argument naming an unknown protocol.
Protocol protocolFromString(const std::string& name);

/// A registration problem whose answer is known. Metres.
struct RegistrationPair {
  Points source;           ///< 3 x N, on the pre-operative surface, about its vertices' mean
  Points source_normals;   ///< 3 x N, outwards
  Points target;           ///< 3 x M, what is seen
  Points truth;            ///< 3 x N, where each source point truly went, in the target's frame
  Eigen::Isometry3d best_rigid = Eigen::Isometry3d::Identity();  ///< least squares source -> truth
  std::optional<Eigen::Vector3f> viewpoint;  ///< where the camera stood, in the target's frame
};

/// Makes a pair from an organ's surface: `points` samples of it, deformed by a thin-plate spline of
/// 0.075 of the extent (RMS), seen as the protocol says. Deterministic for a seed.
RegistrationPair makePair(const Surface& organ, Protocol protocol, int points, std::uint64_t seed);

/// Least-squares rigid transform that takes `from` to `to`, column by column (Kabsch 1976).
Eigen::Isometry3d bestRigidFit(const Points& from, const Points& to);

}  // namespace unirit
