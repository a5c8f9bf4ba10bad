// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "unirit/evaluation/method.hpp"
#include "unirit/network/network.hpp"
#include "unirit/registration.hpp"

namespace unirit {

/// The source as it stands: what every other method must improve on.
class Identity : public RegistrationMethod {
 public:
  std::string name() const override { return "identity"; }
  std::string parameters() const override { return "none"; }
  MethodResult registerPair(const RegistrationPair& pair) override;
};

/// The least-squares rigid fit to the true positions. An oracle, the one method that sees the
/// truth: no rigid method can have a smaller RMSE.
class BestRigidOracle : public RegistrationMethod {
 public:
  std::string name() const override { return "best-rigid (oracle)"; }
  std::string parameters() const override { return "none"; }
  MethodResult registerPair(const RegistrationPair& pair) override;
};

/// Ours: a Registrar with given weights and stages, on the thread that calls it.
class Unirit : public RegistrationMethod {
 public:
  /// `align_centroids`: starts where the node does that has no other guess; else at the identity.
  /// Throws std::invalid_argument as Registrar does.
  Unirit(std::shared_ptr<const Weights> weights, const RegistrationSettings& settings,
         bool align_centroids);

  std::string name() const override;
  std::string parameters() const override;
  MethodResult registerPair(const RegistrationPair& pair) override;

 private:
  std::string weights_hash_;
  bool align_centroids_;
  Registrar registrar_;
};

/// The network as published, which reads row i of the target beside row i of the source: only to
/// reproduce the published tables, whose pairs share their rows. Interior points move rigidly.
class UniritByRows : public RegistrationMethod {
 public:
  /// Throws std::invalid_argument where the weights' pairing is not row.
  explicit UniritByRows(std::shared_ptr<const Weights> weights);

  std::string name() const override { return "unirit-rows"; }
  std::string parameters() const override;
  MethodResult registerPair(const RegistrationPair& pair) override;

 private:
  Network network_;
};

/// What a rigid transform makes of a pair.
MethodResult movedRigidly(const RegistrationPair& pair, const Eigen::Isometry3d& pose);

}  // namespace unirit
