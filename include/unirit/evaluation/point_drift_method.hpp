// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "unirit/evaluation/method.hpp"
#include "unirit/evaluation/point_drift.hpp"

namespace unirit {

/// A drift's settings and how the clouds are brought to it.
template <class Settings>
struct DriftMethodSettings {
  Settings drift;
  bool centroids = true;  ///< starts with the centroids brought together

  template <class Visitor>
  void visit(Visitor&& visitor) {
    drift.visit(visitor);
    visitor("centroids", centroids);
  }
};

using CpdMethodSettings = DriftMethodSettings<CpdSettings>;
using BcpdMethodSettings = DriftMethodSettings<BcpdSettings>;

/// Coherent point drift. The clouds' unit is the source's RMS distance from its centroid.
class CoherentPointDrift : public RegistrationMethod {
 public:
  CoherentPointDrift(bool rigid, const CpdMethodSettings& settings)
      : rigid_(rigid), settings_(settings) {}
  std::string name() const override { return rigid_ ? "cpd-rigid" : "cpd"; }
  std::string parameters() const override;
  MethodResult registerPair(const RegistrationPair& pair) override;

 private:
  bool rigid_;
  CpdMethodSettings settings_;
};

/// Bayesian coherent point drift. The unit is the source's standard deviation per coordinate.
class BayesianPointDrift : public RegistrationMethod {
 public:
  explicit BayesianPointDrift(const BcpdMethodSettings& settings) : settings_(settings) {}
  std::string name() const override { return "bcpd"; }
  std::string parameters() const override;
  MethodResult registerPair(const RegistrationPair& pair) override;

 private:
  BcpdMethodSettings settings_;
};

}  // namespace unirit
