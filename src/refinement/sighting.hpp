// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// What a target shows of the organ. Lengths in the clouds' unit, half the organ's extent.
struct Sighting {
  PointCloud seen;     ///< the target, with normals: of a part towards the eye, else of any sign
  bool whole = false;  ///< all of the surface, else a part of it from one side
  std::optional<Eigen::Vector3f> eye;  ///< from where a part is seen
};

/// A part seen from elsewhere.
Sighting seenFrom(const Eigen::Vector3f& eye, const Sighting& part);

/// The same seen in another frame.
Sighting moved(const Eigen::Isometry3f& transform, const Sighting& sighting);

/// Area of the surface that the points sample evenly, in the points' unit squared: what the discs
/// cover that reach to their 14th nearest points. No outlier that is a minority moves it.
double sampledArea(const Points& points);

/// Tells a whole surface from a part by its area, over `organ_area` (of sampledArea), and by the
/// mean of its normals. A part is seen from the target's viewpoint or, where that is not known or
/// the cloud does not face it, from where its outward normals point: a hollow from its back.
Sighting sightingOf(const PointCloud& target, double organ_area);

}  // namespace unirit
