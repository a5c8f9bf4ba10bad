// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/network/architecture.hpp"

namespace unirit {
namespace {

template <class Widths>
void append(std::vector<LayerShape>& shapes, const std::string& name, int inputs,
            const Widths& widths) {
  for (std::size_t i = 0; i < widths.size(); ++i) {
    shapes.push_back({name + "." + std::to_string(i), inputs, widths[i]});
    inputs = widths[i];
  }
}

}  // namespace

std::vector<LayerShape> layerShapes(Pairing pairing) {
  std::vector<LayerShape> shapes;
  if (pairing == Pairing::kOffsets) {
    append(shapes, "flow.source_encoder", kFlowInputs, kFlowEncoderWidths);
    append(shapes, "flow.target_encoder", kFlowTargetInputs, kFlowEncoderWidths);
    append(shapes, "flow.decoder", kFlowInputs + 2 * kFlowFeatureSize, kFlowDecoderWidths);
    return shapes;
  }
  append(shapes, "rigid.source_encoder", 3, kEncoderWidths);
  append(shapes, "rigid.target_encoder", 3, kEncoderWidths);
  append(shapes, "rigid.decoder", 2 * kFeatureSize, kRigidDecoderWidths);
  append(shapes, "nonrigid.source_encoder", 3, kEncoderWidths);
  append(shapes, "nonrigid.target_encoder", 3, kEncoderWidths);
  append(shapes, "nonrigid.decoder", nonRigidDecoderInputs(pairing), kNonRigidDecoderWidths);
  return shapes;
}

}  // namespace unirit
