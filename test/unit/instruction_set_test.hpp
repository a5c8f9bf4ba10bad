// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "network/kernels.hpp"

namespace unirit {

/// A claim that is checked on every instruction set this processor has.
class InstructionSetTest : public testing::TestWithParam<InstructionSet> {
 protected:
  /// Before the members of a test are made, not in SetUp.
  InstructionSetTest() { limitInstructionSet(GetParam()); }
  ~InstructionSetTest() override { limitInstructionSet(InstructionSet::kAvx512); }
};

inline std::string instructionSetName(const testing::TestParamInfo<InstructionSet>& info) {
  return toString(info.param);
}

}  // namespace unirit

#define UNIRIT_ON_EVERY_INSTRUCTION_SET(Fixture)                                  \
  INSTANTIATE_TEST_SUITE_P(EveryInstructionSet, Fixture,                          \
                           testing::ValuesIn(unirit::supportedInstructionSets()), \
                           unirit::instructionSetName)
