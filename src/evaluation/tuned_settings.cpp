// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/method_factory.hpp"

namespace unirit {

IcpSettings tunedIcp(Protocol) { return {}; }
IcpSettings tunedGeneralizedIcp(Protocol) { return {}; }
CpdMethodSettings tunedRigidCpd(Protocol) { return {}; }
CpdMethodSettings tunedCpd(Protocol) { return {}; }
BcpdMethodSettings tunedBcpd(Protocol) { return {}; }

}  // namespace unirit
