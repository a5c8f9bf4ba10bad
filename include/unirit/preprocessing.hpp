// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"
#include "unirit/settings.hpp"

namespace unirit {

/// A box in a frame of its own.
struct Region {
  Eigen::AlignedBox3d box;        ///< [m]
  Eigen::Isometry3d T_box_cloud;  ///< cloud's frame to the box's
};

/// An intra-operative cloud as it came, and where to look for the organ in it.
struct RawCloud {
  PointCloud cloud;           ///< finite points [m]
  Eigen::Index received = 0;  ///< points before those that are not finite were dropped
  std::optional<Region> region = std::nullopt;  ///< nothing outside of it is wanted
  /// Where the organ is expected, if that is known. Not where its centroid was laid on the cloud's:
  /// that tells nothing of which part of the cloud it is.
  std::optional<Eigen::Isometry3d> T_cloud_organ = std::nullopt;
};

/// How many points were left after a stage.
struct StagePoints {
  std::string stage;
  Eigen::Index points = 0;
};

/// A cloud made ready, and what became of its points.
struct Preprocessed {
  PointCloud cloud;                  ///< some of the raw cloud's points, with their normals
  std::vector<StagePoints> stages;   ///< received, valid (finite, and not at the viewpoint),
                                     ///< then each stage that ran, in order
  std::optional<std::string> fault;  ///< a sentence, where a crop leaves too few points: it names
                                     ///< the parameter
};

/// Makes a cloud ready for the Registrar. The stages, each left out where its setting is off:
/// - region: points inside the region;
/// - margin: points inside the organ's bounding box at the pose expected, wider by the margin;
/// - outliers: without points of sparse places: voxels that, with those around them, hold a small
///   share of the points that others do (flying pixels at the edge of a depth image, for instance);
/// - voxel: of each voxel the point nearest to its centre. Neither the points nor their sequence
///   depends on the cloud's order.
/// The last two are for clouds of more than sampling/points on a surface
/// (Correspondence::kSurface); where that many would not be left, the voxels are halved until they
/// are. Nothing is done where either cloud is empty or the organ's extent is not plausible: the
/// Registrar says so. `organ`: its points, in its own frame [m]. Throws std::invalid_argument where
/// settings are out of range.
Preprocessed preprocess(RawCloud raw, const Points& organ, const RegistrationSettings& settings);

}  // namespace unirit
