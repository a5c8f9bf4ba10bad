// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace unirit::test {

inline constexpr int kSessionViews = 8;  ///< intra-operative clouds in the recorded session

}  // namespace unirit::test
