// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <string>

#include "responsibilities.hpp"
#include "unirit/evaluation/point_drift.hpp"

namespace unirit {

/// Below it the clouds coincide and rounding rules.
constexpr double kSmallestVariance = 10.0 * std::numeric_limits<double>::epsilon();

/// Throws std::invalid_argument where a cloud is empty.
void requirePoints(const DriftClouds& clouds);

/// Throws std::invalid_argument naming the setting unless low < value < high, or value == low where
/// that is allowed.
void requireWithin(const std::string& name, double value, double low, double high,
                   bool low_allowed);

/// Mean squared distance of all source to all target points, per coordinate: where drifts start.
double meanVariance(const DriftClouds& clouds);

/// The similarity, of scale 1 unless `with_scale`, that takes `source` nearest to the targets that
/// explain it.
Similarity fitSimilarity(const Eigen::Matrix3Xd& source, const Responsibilities& responsibilities,
                         bool with_scale);

}  // namespace unirit
