// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// An organ's cloud and its class.
struct LabelledCloud {
  std::string label;
  Points points;
};

struct DivergenceSettings {
  int components = 3;      ///< of each cloud's mixture
  int pairs = 12;          ///< of clouds drawn for each pair of classes
  int repeats = 4;         ///< of the draw
  std::uint64_t seed = 1;  ///< of the mixtures and draws
};

/// Divergence L_mc of class against class.
struct DivergenceTable {
  std::vector<std::string> labels;
  Eigen::MatrixXd mean;    ///< over repeats; NaN where a class has no two clouds to compare
  Eigen::MatrixXd spread;  ///< standard deviation over repeats
};

/// Draws pairs of clouds, within a class always two different ones, each moved to its centroid and
/// scaled to a largest absolute coordinate of 1, so that shapes are compared rather than sizes.
DivergenceTable divergenceTable(const std::vector<LabelledCloud>& clouds,
                                const DivergenceSettings& settings = {});

std::string toMarkdown(const DivergenceTable& table);

}  // namespace unirit
