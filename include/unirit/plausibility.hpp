// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "unirit/metrics.hpp"
#include "unirit/point_cloud.hpp"
#include "unirit/settings.hpp"
#include "unirit/status.hpp"

namespace unirit {

struct Registration;

/// Why a cloud cannot be registered, as a sentence that begins with `name`: too few points, all on
/// one line or in one plane. Nothing where the cloud is fit. What was measured goes to `checks`.
std::optional<std::string> findFault(const PointCloud& cloud, const std::string& name,
                                     const PlausibilitySettings& settings,
                                     std::vector<PlausibilityCheck>& checks);

/// Why the two clouds cannot belong together: an extent of the first that no organ has, or of the
/// second, over that, outside the settings' range. Says so where millimetres taken for metres, or
/// the reverse, explain it. What was measured goes to `checks`.
std::optional<std::string> findMismatch(const PointCloud& preoperative,
                                        const PointCloud& intraoperative,
                                        const PlausibilitySettings& settings,
                                        std::vector<PlausibilityCheck>& checks);

/// Whether the cloud lies about where the start has the organ; both 3 x N, in one frame and unit.
PlausibilityCheck checkOverlap(const Points& predicted, const Points& cloud, double organ_extent,
                               const PlausibilitySettings& settings);

/// Checks of a finished registration: finite, rotation valid, turn from the start, residual,
/// displacement, stretch and folds. Where it was refined also what the displacement gained, what of
/// the organ should be in the cloud and is not, how much was learnt of it, how surprising the
/// displacement is; and how close all of this together comes to its limits.
std::vector<PlausibilityCheck> checkOutput(const Registration& registration,
                                           const Eigen::Isometry3d& start, double organ_extent,
                                           const PlausibilitySettings& settings);

/// Value over limit, or its inverse where the limit is a lower one: above 1 the check failed.
double closeness(const PlausibilityCheck& check);

/// Checks of the new pose against the last accepted one, measured at the organ's centroid.
std::vector<PlausibilityCheck> checkJump(const Eigen::Isometry3d& pose,
                                         const Eigen::Isometry3d& accepted,
                                         const Eigen::Vector3d& organ_centroid,
                                         const PlausibilitySettings& settings);

/// Appends the checks; the first failed one turns a succeeded registration into a refused one and
/// writes the sentence.
void applyChecks(const std::vector<PlausibilityCheck>& checks, Registration& registration);

}  // namespace unirit
