// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "unirit/evaluation/method.hpp"

namespace unirit {

/// Settings of the iterative closest point methods.
struct IcpSettings {
  double max_distance = 0.2;  ///< pairs farther apart are left out; share of the source's extent
  int iterations = 100;       ///< at most
  bool centroids = false;     ///< starts with the centroids brought together

  template <class Visitor>
  void visit(Visitor&& visitor) {
    visitor("max_distance", max_distance);
    visitor("iterations", iterations);
    visitor("centroids", centroids);
  }
};

/// Iterative closest point (Besl & McKay 1992) and generalised ICP (Segal et al. 2009), which
/// measures distances between local planes; both PCL's.
class Icp : public RegistrationMethod {
 public:
  enum class Variant { kPointToPoint, kGeneralized };

  Icp(Variant variant, const IcpSettings& settings) : variant_(variant), settings_(settings) {}
  std::string name() const override { return variant_ == Variant::kGeneralized ? "gicp" : "icp"; }
  std::string parameters() const override;
  MethodResult registerPair(const RegistrationPair& pair) override;

 private:
  Variant variant_;
  IcpSettings settings_;
};

}  // namespace unirit
