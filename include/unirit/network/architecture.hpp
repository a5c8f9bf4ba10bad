// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <vector>

#include "unirit/settings.hpp"

namespace unirit {

/// Outputs of the UniRiT network's layers (Li et al., arXiv 2410.22909, section 4.2, and the FLOP
/// counts of its table 1). Every layer but a decoder's last is followed by a ReLU; no normalisation
/// layers.
inline constexpr std::array<int, 5> kEncoderWidths{64, 64, 64, 128, 1024};
inline constexpr std::array<int, 6> kRigidDecoderWidths{1024, 1024, 512, 512, 256, 7};
inline constexpr std::array<int, 6> kNonRigidDecoderWidths{1024, 512, 256, 128, 64, 3};
inline constexpr int kFeatureSize = 1024;

/// With pairing offsets a smaller rigid module goes on where the published one has brought the
/// organ near: its encoders, and the non-rigid module's, read beside a point (3) the way to the
/// nearest point of the other cloud (3), which tells what is left of the error there.
inline constexpr std::array<int, 5> kFineEncoderWidths{64, 64, 64, 128, 512};
inline constexpr std::array<int, 3> kFineDecoderWidths{256, 256, 7};
inline constexpr int kOffsetInputs = 6;

/// Iterations of the published rigid module before the fine one's.
constexpr int coarseIterations(Pairing pairing, int iterations) {
  constexpr int kCoarse = 2;
  return pairing == Pairing::kOffsets && iterations > kCoarse ? kCoarse : iterations;
}

/// Inputs of the non-rigid module's encoders.
constexpr int nonRigidEncoderInputs(Pairing pairing) {
  return pairing == Pairing::kOffsets ? kOffsetInputs : 3;
}

/// Inputs of the non-rigid decoder: point (3), two global features (2048), paired row (3 or none).
constexpr int nonRigidDecoderInputs(Pairing pairing) {
  return 3 + 2 * kFeatureSize + (pairing == Pairing::kNone ? 0 : 3);
}

/// One fully connected layer as it stands in a weights file: tensors NAME.weight, row-major
/// [outputs, inputs], and NAME.bias, [outputs].
struct LayerShape {
  std::string name;
  int inputs = 0;
  int outputs = 0;
};

/// All layers in the file's order: rigid.source_encoder.0 to .4, rigid.target_encoder.0 ...,
/// rigid.decoder.0 to .5, with pairing offsets the same of fine, with a decoder of .0 to .2, and
/// nonrigid.source_encoder, nonrigid.target_encoder, nonrigid.decoder.
/// The columns of nonrigid.decoder.0 are: point, source feature, target feature, paired row.
std::vector<LayerShape> layerShapes(Pairing pairing);

}  // namespace unirit
