// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "coherent_solver.hpp"
#include "correspondence.hpp"
#include "sighting.hpp"
#include "unirit/settings.hpp"
#include "visibility.hpp"

namespace unirit {

/// The expectation step of the refinement, for one sampling of the organ: which of its points,
/// moved as a search has them, belongs to what was seen. Keeps its buffers from search to search.
class Expectation {
 public:
  /// `source`: 3 x N samples of the organ with outward normals; it, `kernels` and `team` must
  /// outlive this.
  Expectation(const PointCloud& source, Correspondence correspondence, const Kernels& kernels,
              ThreadTeam& team);

  /// From now on this was seen.
  void look(const Sighting& sighting);

  /// After look. `sigma`: standard deviation of the distance, the clouds' unit.
  const Correspondences& at(const CoherentState& state, float sigma);

  const Visibility& visibility() const { return visibility_; }

 private:
  void turnNormals();

  const PointCloud& source_;
  Correspondence correspondence_;
  Visibility visibility_;
  CorrespondenceEstimator estimator_;
  Attraction attraction_;
  std::optional<Eigen::Vector3f> eye_;
  Points bent_;
  PointCloud moved_;
  Eigen::RowVectorXf visible_;
  Correspondences correspondences_;
};

}  // namespace unirit
