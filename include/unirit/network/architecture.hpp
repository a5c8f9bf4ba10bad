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

/// With pairing offsets one smaller module does both stages: it tells the way each point of the
/// source has still to go, its scene flow, and is asked again from where that has led. An iteration
/// of the rigid stage is the best rigid fit of a few such steps. Beside a point the module reads
/// where the clouds lie to each other about it: vectors to the nearest point of the other cloud,
/// either way, over neighbourhoods of several sizes, and the shortest way to the planes on which
/// the target's points lie there; where a coherent motion of the whole takes it that brings the
/// source to those planes; and how the steps so far have deformed the source, which is what their
/// best rigid fit leaves of them.
inline constexpr std::array<int, 5> kFlowEncoderWidths{64, 64, 64, 128, 256};
inline constexpr int kFlowFeatureSize = kFlowEncoderWidths.back();
inline constexpr std::array<float, 4> kFlowScales{0.8F, 0.4F, 0.2F, 0.1F};  ///< half extents
/// Weight of the target's points below which their mean vector fades to zero.
inline constexpr float kFlowFewest = 0.01F;
/// Weight of staying where one is, beside the target's planes, in the way to them.
inline constexpr float kFlowPlaneRidge = 0.05F;
/// The coherent way to the target's planes (see coherent_way.hpp); lengths in half extents.
inline constexpr int kFlowPlanes = 256;               ///< at most, evenly chosen
inline constexpr float kFlowLength = kFlowScales[1];  ///< of the deformation
inline constexpr float kFlowAmplitude = 0.15F;
inline constexpr float kFlowRigidAmplitude = 0.5F;  ///< of translation and rotation vector
inline constexpr float kFlowPlaneNoise = 0.08F;
inline constexpr float kFlowPlaneReach = 0.1F;  ///< offset at which the noise's variance doubles
/// Share of a plane's own variance that is noise, too: more than rounding makes of any cloud.
inline constexpr float kFlowPlaneRounding = 1e-4F;
inline constexpr int kFlowVectors = 3 + 4 * static_cast<int>(kFlowScales.size());
/// Point (3), for each scale the share of the target found there, the vectors, their lengths.
inline constexpr int kFlowFirstVector = 3 + static_cast<int>(kFlowScales.size());
inline constexpr int kFlowInputs = kFlowFirstVector + 4 * kFlowVectors;
/// What is read beside a point of the target: itself (3) and the vector to the source's nearest.
inline constexpr int kFlowTargetInputs = 6;
/// A displacement, and how much of each vector is added to it.
inline constexpr std::array<int, 4> kFlowDecoderWidths{128, 128, 128, 3 + kFlowVectors};
/// All iterations of the rigid stage but the last are coarse: they read at most so many points of
/// each cloud, evenly chosen in the order of their coordinates, and follow the flow for few steps.
inline constexpr int kFlowCoarsePoints = 320;
inline constexpr int kFlowCoarseSteps = 3;
/// The last is fine: it reads all points and follows the flow for longer. It comes after one that
/// moves the points by less than this, RMS [half extents]: more coarse ones would drift.
inline constexpr float kFlowConverged = 0.08F;
inline constexpr int kFlowFineSteps = 6;
/// Of the non-rigid stage.
inline constexpr int kFlowNonRigidSteps = 3;

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
/// rigid.decoder.0 to .5, and the same of nonrigid; with pairing offsets those of flow alone.
/// The columns of nonrigid.decoder.0 are: point, source feature, target feature, paired row; those
/// of flow.decoder.0: what is read of a point, source feature, target feature.
std::vector<LayerShape> layerShapes(Pairing pairing);

}  // namespace unirit
