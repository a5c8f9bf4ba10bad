// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "coherent_way.hpp"
#include "unirit/point_cloud.hpp"
#include "workspace.hpp"

namespace unirit {

/// What the flow module reads about the points of two clouds (see architecture.hpp). The target's
/// order decides which of its planes the coherent way is fitted to; else results depend on either
/// order in the last bits, and in which of two equally near points is taken. Holds buffers that
/// grow to the largest clouds seen.
class Surroundings {
 public:
  explicit Surroundings(Workspace& workspace) : workspace_(workspace), way_(workspace.kernels()) {}

  /// The first to be called; the normals of its surface are estimated. Points in the order of their
  /// coordinates spread over the surface those whose planes are fitted to.
  void setTarget(const Points& target);

  /// `deformation`: of each point.
  void setSource(const Points& source, const Points& deformation);

  /// kFlowTargetInputs numbers for each point of the target.
  RowsView ofTarget() const;

  /// Fills kFlowInputs numbers for each point of the source.
  RowsView ofSource(std::vector<float>& rows) const;

  /// The same for each of `queries`, which are deformed as well, among the source's points.
  RowsView of(const Points& queries, const Points& deformation, std::vector<float>& rows) const;

 private:
  void read(const Points& queries, const Points& deformation, long begin, long count,
            const int* nearest, float* rows) const;
  void fitCoherentWay();

  Workspace& workspace_;
  Points source_, deformation_, target_, target_normals_;
  CoherentWay way_;
  Points plane_points_, plane_offsets_, plane_normals_;  // of some of the target's points
  std::vector<int> nearest_target_, nearest_source_;     // of each source, of each target point
  Eigen::Matrix<float, kFlowTargetInputs, Eigen::Dynamic> of_target_;
  Eigen::Matrix<float, kAveraged, Eigen::Dynamic> values_, target_values_;  // to be averaged
};

}  // namespace unirit
