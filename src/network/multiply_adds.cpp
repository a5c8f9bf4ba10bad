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
  const double encoder = multiplyAddsPerRow(encoderInputs(pairing), kEncoderWidths);
  // what the target's points read changes with the source's pose where they read the way to it
  const int target_encodings = pairing == Pairing::kOffsets ? rigid_iterations : 1;
  const double rigid = encoder * (rigid_iterations * sources + target_encodings * targets) +
                       rigid_iterations * multiplyAddsPerRow(2 * kFeatureSize, kRigidDecoderWidths);

  constexpr double kFeatureColumns = 2.0 * kFeatureSize * kNonRigidDecoderWidths.front();
  const double decoder = multiplyAddsPerRow(nonRigidDecoderInputs(pairing), kNonRigidDecoderWidths);
  const double nonrigid = encoder * (sources + targets) + sources * (decoder - kFeatureColumns) +
                          (with_savings ? 1.0 : sources) * kFeatureColumns;
  return rigid + nonrigid;
}

}  // namespace unirit
