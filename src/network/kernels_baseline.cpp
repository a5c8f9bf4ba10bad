// SPDX-License-Identifier: BSD-3-Clause
#include "kernel_loops.hpp"

namespace unirit {

extern const Kernels kBaselineKernels = Loops<4, 4, 2>::kernels(InstructionSet::kBaseline);

}  // namespace unirit
