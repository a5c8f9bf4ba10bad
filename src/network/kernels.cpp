// SPDX-License-Identifier: BSD-3-Clause
#include "kernels.hpp"

#include <atomic>

namespace unirit {

extern const Kernels kBaselineKernels;
#if defined(__x86_64__)
extern const Kernels kAvx2Kernels;
extern const Kernels kAvx512Kernels;
#endif

namespace {

std::atomic<InstructionSet> highest_allowed{InstructionSet::kAvx512};

/// Kernels this processor can run, from the baseline up.
std::vector<const Kernels*> supportedKernels() {
  std::vector<const Kernels*> kernels{&kBaselineKernels};
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    kernels.push_back(&kAvx2Kernels);
    if (__builtin_cpu_supports("avx512f")) {
      kernels.push_back(&kAvx512Kernels);
    }
  }
#endif
  return kernels;
}

}  // namespace

const char* toString(InstructionSet instruction_set) {
  switch (instruction_set) {
    case InstructionSet::kAvx512:
      return "avx512";
    case InstructionSet::kAvx2:
      return "avx2";
    case InstructionSet::kBaseline:
      break;
  }
  return "baseline";
}

std::vector<InstructionSet> supportedInstructionSets() {
  std::vector<InstructionSet> sets;
  for (const Kernels* kernels : supportedKernels()) {
    sets.push_back(kernels->instruction_set);
  }
  return sets;
}

const Kernels& selectKernels() {
  const Kernels* best = &kBaselineKernels;
  for (const Kernels* kernels : supportedKernels()) {
    if (kernels->instruction_set <= highest_allowed) {
      best = kernels;
    }
  }
  return *best;
}

void limitInstructionSet(InstructionSet highest) { highest_allowed = highest; }

}  // namespace unirit
