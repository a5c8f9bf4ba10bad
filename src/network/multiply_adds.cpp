// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "unirit/network/network.hpp"

namespace unirit {
namespace {

/// Of a stack of layers, for one row.
template <class Widths>
double multiplyAddsPerRow(int inputs, const Widths& widths) {
  double sum = 0.0;
  for (const int outputs : widths) {
    sum += static_cast<double>(inputs) * outputs;
    inputs = outputs;
  }
  return sum;
}

double flowMultiplyAdds(double sources, double targets, bool with_savings) {
  constexpr double kFeatureColumns = 2.0 * kFlowFeatureSize * kFlowDecoderWidths.front();
  const double point = multiplyAddsPerRow(kFlowInputs, kFlowEncoderWidths) +
                       multiplyAddsPerRow(kFlowInputs, kFlowDecoderWidths);
  return point * sources + multiplyAddsPerRow(kFlowTargetInputs, kFlowEncoderWidths) * targets +
         (with_savings ? 1.0 : sources) * kFeatureColumns;
}

}  // namespace

double multiplyAdds(Eigen::Index source_points, Eigen::Index target_points, int rigid_iterations,
                    Pairing pairing, bool with_savings) {
  const auto sources = static_cast<double>(source_points);
  const auto targets = static_cast<double>(target_points);
  if (pairing == Pairing::kOffsets) {
    const double few = kFlowCoarsePoints;
    return std::max(rigid_iterations - 1, 0) * kFlowCoarseSteps *
               flowMultiplyAdds(std::min(sources, few), std::min(targets, few), with_savings) +
           (kFlowFineSteps + kFlowNonRigidSteps) * flowMultiplyAdds(sources, targets, with_savings);
  }
  const double rigid =
      multiplyAddsPerRow(3, kEncoderWidths) * (rigid_iterations * sources + targets) +
      rigid_iterations * multiplyAddsPerRow(2 * kFeatureSize, kRigidDecoderWidths);

  constexpr double kFeatureColumns = 2.0 * kFeatureSize * kNonRigidDecoderWidths.front();
  const double decoder = multiplyAddsPerRow(nonRigidDecoderInputs(pairing), kNonRigidDecoderWidths);
  const double encoder = multiplyAddsPerRow(3, kEncoderWidths);
  const double nonrigid = encoder * (sources + targets) + sources * (decoder - kFeatureColumns) +
                          (with_savings ? 1.0 : sources) * kFeatureColumns;
  return rigid + nonrigid;
}

}  // namespace unirit
