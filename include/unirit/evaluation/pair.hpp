// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"
#include "unirit/random.hpp"

namespace unirit {

/// How a target is made from a deformed organ; docs/benchmark.md describes each.
enum class Protocol {
  kPaired,
  kPermuted,
  kResampled,
  kCaseB,
  kPartial,
  kOffset,
  kIntraop,
  kCamera
};

/// In the sequence of their declaration.
const std::vector<Protocol>& allProtocols();

const char* toString(Protocol protocol);

/// Throws std::invalid_argument naming an unknown protocol.
Protocol protocolFromString(const std::string& name);

/// What is seen of a deformed organ, and from where.
struct View {
  /// The source's own points (in order or not), fresh ones, or those of a depth image.
  enum class Target { kPaired, kPermuted, kResampled, kDepthImage };
  Target target = Target::kResampled;
  double visible_share = 1.0;  ///< of fresh ones, the part that faces the camera most
  double rotation = 0.0;       ///< about a random axis, at most [degree]
  double translation = 0.0;    ///< per axis, at most, over the half extent
  double offset = 0.0;         ///< further translation in a random direction [m]
  double noise = 0.0;          ///< standard deviation per axis, in a depth image along the ray [m]
  double outlier_share = 0.0;  ///< of the points, scattered around the organ, or along their rays
};

View viewOf(Protocol protocol);

/// A registration problem whose answer is known. Metres.
struct RegistrationPair {
  Points source;          ///< 3 x N, on the pre-operative surface, about its vertices' mean
  Points source_normals;  ///< 3 x N, outwards
  Points target;          ///< 3 x N, what is seen
  Points truth;           ///< 3 x N, where each source point truly went, in the target's frame
  Points interior;        ///< 3 x M, at most 200 points inside the organ, in the source's frame
  Points interior_truth;  ///< 3 x M, where they truly went, in the target's frame
  Points surface;         ///< 3 x S, samples of the true deformed surface, in the target's frame
  Eigen::Isometry3d best_rigid = Eigen::Isometry3d::Identity();  ///< least squares source -> truth
  std::optional<Eigen::Vector3f> viewpoint;  ///< where the camera stood, in the target's frame
};

/// Points of a deformed organ in the source's frame: what its pairs share under every view.
struct DeformedPoints {
  Points source;          ///< 3 x N
  Points source_normals;  ///< 3 x N
  Points truth;           ///< 3 x N, where the deformation alone takes the source points
  Points interior;        ///< 3 x M
  Points interior_truth;  ///< 3 x M
  Points surface;         ///< 3 x S, samples of the deformed surface
};

/// What is seen of such an organ.
struct Sight {
  Points target;           ///< 3 x N, in the target's frame
  Eigen::Isometry3d pose;  ///< from the source's frame to the target's, on top of the deformation
  std::optional<Eigen::Vector3f> viewpoint;  ///< in the target's frame
};

RegistrationPair joinPair(const DeformedPoints& points, const Sight& sight);

/// An organ's surface under one random thin-plate deformation of 0.075 of its extent (RMS), from
/// which pairs are drawn. The RMS is measured over up to 1500 vertices.
class DeformedOrgan {
 public:
  /// `pool`: how many points are sampled on the deformed surface for pairs to draw from; on the
  /// organ's own as many, at most 10,000.
  DeformedOrgan(const Surface& organ, std::uint64_t seed, Eigen::Index pool = 30000);

  /// `points` source and target points under the view, and the first `surface_samples` of the pool
  /// as `surface`. Deterministic for a seed. Throws std::invalid_argument where the pool or its
  /// visible share holds fewer points.
  RegistrationPair pair(const View& view, Eigen::Index points, std::uint64_t seed,
                        Eigen::Index surface_samples = 0) const;

  /// The two halves of a pair: the points drawn, and `truth`, of theirs, under the view.
  DeformedPoints drawPoints(Eigen::Index points, Eigen::Index surface_samples,
                            Random& random) const;
  Sight see(const View& view, const Points& truth, Random& random) const;

 private:
  Points targetOf(const View& view, const Eigen::Vector3d& eye, const Points& truth,
                  Random& random) const;

  PointCloud source_pool_;
  Points truth_pool_;
  Surface deformed_;
  PointCloud target_pool_;
  Points interior_;
  Points interior_truth_;
  double half_extent_ = 0.0;  // of the undeformed vertices [m]
};

/// A pair as the protocol says: DeformedOrgan and View in one call, with 20,000 samples of the true
/// surface. The same seed gives every protocol the same source and deformation.
RegistrationPair makePair(const Surface& organ, Protocol protocol, Eigen::Index points,
                          std::uint64_t seed);

/// The same under any view.
RegistrationPair makePair(const Surface& organ, const View& view, Eigen::Index points,
                          std::uint64_t seed);

/// A deformed organ under several views, and what they share.
struct SeenOrgan {
  DeformedPoints points;
  std::vector<Sight> sights;  ///< one for each protocol, in their sequence
};

/// The pairs that makePair makes of each protocol with this seed, bit for bit, with
/// `surface_samples` in place of the 20,000.
SeenOrgan makeSeenOrgan(const Surface& organ, const std::vector<Protocol>& protocols,
                        Eigen::Index points, Eigen::Index surface_samples, std::uint64_t seed);

/// Least-squares rigid transform that takes `from` to `to`, column by column (Kabsch 1976).
Eigen::Isometry3d bestRigidFit(const Points& from, const Points& to);

}  // namespace unirit
