// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "unirit/point_cloud.hpp"
#include "workspace.hpp"

namespace unirit {

/// Where two clouds lie to each other about their points, as the flow module reads it (see
/// architecture.hpp). Holds buffers that grow to the largest clouds seen.
class Surroundings {
 public:
  explicit Surroundings(Workspace& workspace) : workspace_(workspace) {}

  /// Sets the clouds. Results depend on their points' order in the last bits, and in which of two
  /// equally near points is taken.
  void setClouds(const Points& source, const Points& target);

  /// kFlowTargetInputs numbers for each point of the target.
  RowsView ofTarget() const;

  /// Fills kFlowInputs numbers for each point of the source.
  RowsView ofSource(std::vector<float>& rows) const;

  /// The same for each of `queries`, among the source's points.
  RowsView of(const Points& queries, std::vector<float>& rows) const;

 private:
  void read(const Points& queries, long begin, long count, const int* nearest, float* rows) const;

  Workspace& workspace_;
  Points source_, target_;
  std::vector<int> nearest_target_, nearest_source_;  // of each source, of each target point
  Eigen::Matrix<float, kFlowTargetInputs, Eigen::Dynamic> of_target_;
  Eigen::Matrix<float, kAveraged, Eigen::Dynamic> values_;  // of source points, to be averaged
};

}  // namespace unirit
