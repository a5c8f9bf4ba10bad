// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "refinement/refinement.hpp"
#include "unirit/network/network.hpp"
#include "unirit/point_cloud.hpp"
#include "unirit/settings.hpp"

namespace unirit {

/// The organ, sampled and normalised: what does not change from one view to the next, and the way
/// between its frame in metres and the network's unit.
struct OrganModel {
  /// `team` must outlive it.
  OrganModel(const PointCloud& organ, const RegistrationSettings& settings, ThreadTeam& team);

  bool isOf(const PointCloud& organ) const;

  /// As many points of a cloud as of the organ and, where it is known, its viewpoint; in the
  /// network's unit.
  PointCloud sample(const PointCloud& seen, const Eigen::Isometry3d& T_organ_cloud) const;

  /// A motion within the organ's frame.
  Eigen::Isometry3d toMetres(const Eigen::Isometry3f& motion) const;
  Eigen::Isometry3f toUnit(const Eigen::Isometry3d& motion) const;

  PointCloud cloud;  ///< as given
  double extent;     ///< [m]
  Eigen::Index sample_count;
  Points samples;  ///< of the cloud
  Normalisation normalisation;
  PointCloud sampled;                      ///< samples with normals, the network's unit
  Points vertices;                         ///< every point, the network's unit
  std::unique_ptr<Refinement> refinement;  ///< where the settings have that stage
  Eigen::MatrixXf functions;               ///< the refinement's prior's, at every point
};

}  // namespace unirit
