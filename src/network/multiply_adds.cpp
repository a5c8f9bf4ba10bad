// SPDX-License-Identifier: BSD-3-Clause
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

}  // namespace

double multiplyAdds(Eigen::Index source_points, Eigen::Index target_points, int rigid_iterations,
                    Pairing pairing, bool with_savings) {
  const auto sources = static_cast<double>(source_points);
  const auto targets = static_cast<double>(target_points);
  const int coarse = coarseIterations(pairing, rigid_iterations);
  const double rigid = multiplyAddsPerRow(3, kEncoderWidths) * (coarse * sources + targets) +
                       coarse * multiplyAddsPerRow(2 * kFeatureSize, kRigidDecoderWidths);
  const double fine = multiplyAddsPerRow(kOffsetInputs, kFineEncoderWidths) * (sources + targets) +
                      multiplyAddsPerRow(2 * kFineEncoderWidths.back(), kFineDecoderWidths);

  constexpr double kFeatureColumns = 2.0 * kFeatureSize * kNonRigidDecoderWidths.front();
  const double decoder = multiplyAddsPerRow(nonRigidDecoderInputs(pairing), kNonRigidDecoderWidths);
  const double encoder = multiplyAddsPerRow(nonRigidEncoderInputs(pairing), kEncoderWidths);
  const double nonrigid = encoder * (sources + targets) + sources * (decoder - kFeatureColumns) +
                          (with_savings ? 1.0 : sources) * kFeatureColumns;
  return rigid + (rigid_iterations - coarse) * fine + nonrigid;
}

}  // namespace unirit
