// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/network/network.hpp"

namespace unirit {
namespace {

/// Of a stack of layers, for one row.
template <class Widths>
double multiplyAddsPerRow(const Widths& widths) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    sum += static_cast<double>(widths[i]) * widths[i + 1];
  }
  return sum;
}

}  // namespace

double multiplyAdds(Eigen::Index source_points, Eigen::Index target_points, int rigid_iterations,
                    Pairing pairing, bool with_savings) {
  const auto sources = static_cast<double>(source_points);
  const auto targets = static_cast<double>(target_points);
  const double encoder = multiplyAddsPerRow(kEncoderWidths);
  const double rigid = encoder * (rigid_iterations * sources + targets) +
                       rigid_iterations * multiplyAddsPerRow(kRigidDecoderWidths);

  constexpr double kFirstOutputs = kNonRigidDecoderHiddenWidths.front();
  constexpr double kFeatureColumns = 2.0 * kFeatureSize * kFirstOutputs;
  const double point_columns = nonRigidDecoderInputs(pairing) * kFirstOutputs - kFeatureColumns;
  const double nonrigid =
      encoder * (sources + targets) +
      sources * (point_columns + multiplyAddsPerRow(kNonRigidDecoderHiddenWidths)) +
      (with_savings ? 1.0 : sources) * kFeatureColumns;
  return rigid + nonrigid;
}

}  // namespace unirit
