// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <stdexcept>

#include "unirit/evaluation/pair.hpp"

namespace unirit {
namespace {

constexpr std::array<Protocol, 7> kProtocols{
    Protocol::kPaired,  Protocol::kPermuted, Protocol::kResampled, Protocol::kCaseB,
    Protocol::kPartial, Protocol::kOffset,   Protocol::kIntraop};

}  // namespace

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
  }
  return "unknown";
}

Protocol protocolFromString(const std::string& name) {
  for (const Protocol protocol : kProtocols) {
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
      view.rotation = 20.0;
      view.translation = 0.1;
      view.noise = 0.0015;
      view.outlier_share = 0.05;
      break;
  }
  return view;
}

}  // namespace unirit
