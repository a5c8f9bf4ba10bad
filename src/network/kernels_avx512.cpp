// SPDX-License-Identifier: BSD-3-Clause
#include "kernel_loops.hpp"

namespace unirit {

extern const Kernels kAvx512Kernels = Loops<16, 12, 2>::kernels(InstructionSet::kAvx512);

}  // namespace unirit
