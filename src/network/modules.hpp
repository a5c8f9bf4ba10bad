// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>

#include "rigid_decoder.hpp"
#include "unirit/point_cloud.hpp"
#include "unirit/settings.hpp"
#include "workspace.hpp"

namespace unirit {

/// What the network's two stages compute, of one kind of weights.
class Modules {
 public:
  virtual ~Modules() = default;

  /// A rigid iteration from where the source has been moved. `first`: of these clouds; `fine`: by
  /// smaller steps of all points, where the kind has such, as the last iteration is.
  virtual RigidStep rigidStep(const Points& moved, const Points& target, bool first, bool fine) = 0;

  /// Writes the displacements of `queries`, whose size they have, given the rigidly moved source.
  virtual void displace(const Points& source, const Points& target, const Points& queries,
                        Points& displacements) = 0;

  /// Global features of the last call of each, of the source, then of the target.
  virtual const Eigen::VectorXf& rigidFeatures() const = 0;
  virtual const Eigen::VectorXf& nonRigidFeatures() const = 0;
};

/// The paper's rigid and non-rigid modules; the workspace must outlive them.
std::unique_ptr<Modules> makePublishedModules(const Weights& weights, Workspace& workspace);

/// The one module of pairing offsets.
std::unique_ptr<Modules> makeFlowModule(const Weights& weights, Workspace& workspace);

}  // namespace unirit
