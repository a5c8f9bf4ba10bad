// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/network/architecture.hpp"

namespace unirit {
namespace {

template <class Widths>
void append(std::vector<LayerShape>& shapes, const std::string& name, const Widths& widths) {
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) {
    shapes.push_back({name + "." + std::to_string(i), widths[i], widths[i + 1]});
  }
}

}  // namespace

std::vector<LayerShape> layerShapes(Pairing pairing) {
  std::vector<int> decoder{nonRigidDecoderInputs(pairing)};
  decoder.insert(decoder.end(), kNonRigidDecoderHiddenWidths.begin(),
                 kNonRigidDecoderHiddenWidths.end());

  std::vector<LayerShape> shapes;
  append(shapes, "rigid.source_encoder", kEncoderWidths);
  append(shapes, "rigid.target_encoder", kEncoderWidths);
  append(shapes, "rigid.decoder", kRigidDecoderWidths);
  append(shapes, "nonrigid.source_encoder", kEncoderWidths);
  append(shapes, "nonrigid.target_encoder", kEncoderWidths);
  append(shapes, "nonrigid.decoder", decoder);
  return shapes;
}

}  // namespace unirit
