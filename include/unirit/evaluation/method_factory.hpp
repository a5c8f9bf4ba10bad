// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "unirit/evaluation/icp.hpp"
#include "unirit/evaluation/method.hpp"
#include "unirit/evaluation/point_drift_method.hpp"
#include "unirit/network/weights.hpp"

namespace unirit {

/// The rivals' parameters, found on training organs; docs/benchmark.md tells how.
IcpSettings tunedIcp(Protocol protocol);
IcpSettings tunedGeneralizedIcp(Protocol protocol);
CpdMethodSettings tunedRigidCpd(Protocol protocol);
CpdMethodSettings tunedCpd(Protocol protocol);
BcpdMethodSettings tunedBcpd(Protocol protocol);

/// Makes methods of descriptions "NAME[:KEY=VALUE]...", names being identity, best-rigid, icp,
/// gicp, cpd-rigid, cpd, bcpd, unirit. Keys are the settings of the method, which else are those
/// tuned for the protocol; of unirit they are `weights` (a file), `stages` (joined by +) and
/// `start` (identity or centroids).
class MethodFactory {
 public:
  /// `weights`: file that unirit's methods use without another; may be empty.
  explicit MethodFactory(std::string weights) : default_weights_(std::move(weights)) {}

  /// Throws std::invalid_argument naming what in the description is wrong, std::runtime_error
  /// where weights cannot be read. Not for several threads at once.
  std::unique_ptr<RegistrationMethod> make(const std::string& description, Protocol protocol);

 private:
  std::shared_ptr<const Weights> weights(const std::string& path);

  std::string default_weights_;
  std::map<std::string, std::shared_ptr<const Weights>> weights_;  // by path, each read once
};

}  // namespace unirit
