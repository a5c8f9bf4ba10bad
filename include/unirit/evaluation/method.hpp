// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "unirit/evaluation/pair.hpp"

namespace unirit {

/// What a method makes of a pair. Metres, the target's frame.
struct MethodResult {
  bool refused = false;  ///< the method says that it failed; the points below stand at their start
  Points source;         ///< 3 x N, the pair's source points, moved
  Points interior;       ///< 3 x M, the pair's interior points, moved
  std::optional<Eigen::Isometry3d> pose;  ///< the rigid part, where the method has one
  Eigen::RowVectorXf deviations = {};     ///< of the source's points, as a length, as the method
                                          ///< has them [m]; empty where it does not
};

/// A way to register: ours and its rivals, told apart by name in the benchmark's tables. It sees
/// of a pair the source, its normals, the target and the viewpoint, never the truth; only an
/// oracle, which says so in its name, sees more. One object serves one thread.
class RegistrationMethod {
 public:
  virtual ~RegistrationMethod() = default;
  virtual std::string name() const = 0;

  /// All that the result depends on beside the pair, as one word: settings, weights.
  virtual std::string parameters() const = 0;

  virtual MethodResult registerPair(const RegistrationPair& pair) = 0;
};

}  // namespace unirit
