// SPDX-License-Identifier: BSD-3-Clause
#include "kernel_loops.hpp"

namespace unirit {

extern const Kernels kAvx2Kernels = Loops<8, 6, 2>::kernels(InstructionSet::kAvx2);

}  // namespace unirit
