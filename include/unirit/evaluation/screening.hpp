// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// What tells a usable organ surface from a broken one.
struct SurfaceMeasures {
  Eigen::Index faces = 0;
  double length = 0.0;      ///< between two vertices far apart (double sweep) [m]
  double open_share = 0.0;  ///< flat area of the holes over that of the surface
  double main_piece = 0.0;  ///< share of the area that belongs to the largest connected piece
};

/// Holes are loops of edges with a single face, each measured by its vector area.
SurfaceMeasures measureSurface(const Surface& surface);

struct LengthRange {
  double least = 0.0;  ///< [m]
  double most = 0.0;   ///< [m]
};

/// Which surfaces are taken.
struct ScreeningLimits {
  Eigen::Index min_faces = 400;
  double max_open_share = 0.25;
  double min_main_piece = 0.3;
  std::map<std::string, LengthRange> lengths = plausibleLengths();  ///< by organ
  LengthRange other_length{0.01, 1.0};                              ///< of organs without a range

  /// Ranges for the organs of the benchmark: wider than what is normal in adults, so that only
  /// fragments, other organs and other units fall outside.
  static std::map<std::string, LengthRange> plausibleLengths();
};

/// A clause that says why the surface is rejected, "has 12 faces, ...", or nothing where it is
/// taken.
std::string rejectionReason(const Surface& surface, const std::string& organ,
                            const ScreeningLimits& limits);

}  // namespace unirit
