// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "unirit/evaluation/pair.hpp"

namespace unirit {
namespace {

/// Moved and disturbed as in the operating room.
void makeIntraoperative(View& view) {
  view.rotation = 20.0;
  view.translation = 0.1;
  view.noise = 0.0015;
  view.outlier_share = 0.05;
}

}  // namespace

const std::vector<Protocol>& allProtocols() {
  static const std::vector<Protocol> protocols{
      Protocol::kPaired,  Protocol::kPermuted, Protocol::kResampled, Protocol::kCaseB,
      Protocol::kPartial, Protocol::kOffset,   Protocol::kIntraop,   Protocol::kCamera};
  return protocols;
}

const char* toString(Protocol protocol) {
  switch (protocol) {
    case Protocol::kPaired:
      return "paired";
    case Protocol::kPermuted:
      return "permuted";
    case Protocol::kResampled:
      return "resampled";
    case Protocol::kCaseB:
      return "caseb";
    case Protocol::kPartial:
      return "partial";
    case Protocol::kOffset:
      return "offset";
    case Protocol::kIntraop:
      return "intraop";
    case Protocol::kCamera:
      return "camera";
  }
  return "unknown";
}

Protocol protocolFromString(const std::string& name) {
  for (const Protocol protocol : allProtocols()) {
    if (name == toString(protocol)) return protocol;
  }
  throw std::invalid_argument("protocol: unknown protocol '" + name + "'");
}

View viewOf(Protocol protocol) {
  View view;
  switch (protocol) {
    case Protocol::kPaired:
      view.target = View::Target::kPaired;
      break;
    case Protocol::kPermuted:
      view.target = View::Target::kPermuted;
      break;
    case Protocol::kResampled:
      break;
    case Protocol::kOffset:
      view.offset = 0.5;
      [[fallthrough]];
    case Protocol::kCaseB:
      view.rotation = 45.0;
      view.translation = 0.2;
      break;
    case Protocol::kPartial:
      view.visible_share = 0.4;
      break;
    case Protocol::kIntraop:
      view.visible_share = 0.35;
      makeIntraoperative(view);
      break;
    case Protocol::kCamera:
      view.target = View::Target::kDepthImage;
      makeIntraoperative(view);
      break;
  }
  return view;
}

}  // namespace unirit
