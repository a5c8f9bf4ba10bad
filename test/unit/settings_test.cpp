// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/settings.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace unirit {
namespace {

std::string faultOf(const RegistrationSettings& settings) {
  try {
    validate(settings);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Settings, DefaultsAreValid) { EXPECT_EQ(faultOf({}), ""); }

TEST(Settings, ValuesOutsideTheirRangeAreNamed) {
  RegistrationSettings settings;
  settings.plausibility.max_residual = -0.1;
  EXPECT_EQ(faultOf(settings), "plausibility/max_residual: -0.1 is outside [0, 1]");
  settings = {};
  settings.plausibility.inlier_tolerance = std::nan("");
  EXPECT_NE(faultOf(settings).find("plausibility/inlier_tolerance"), std::string::npos);
  settings = {};
  settings.threads = 0;
  EXPECT_NE(faultOf(settings).find("threads"), std::string::npos);
  settings = {};
  settings.stages.clear();
  EXPECT_NE(faultOf(settings).find("stages"), std::string::npos);
}

TEST(Settings, EverySettingChangesTheHash) {
  const RegistrationSettings defaults;
  int visited = 0;
  RegistrationSettings changed;
  visitSettings(changed, [&](const char* name, auto& value, auto, auto, const char*) {
    const auto before = value;
    value += 1;
    EXPECT_NE(sha256(changed), sha256(defaults)) << name;
    value = before;
    ++visited;
  });
  EXPECT_GT(visited, 10);
  changed.stages = {Stage::kRigid};
  EXPECT_NE(sha256(changed), sha256(defaults));
}

TEST(Stages, AreReadInTheirOrder) {
  EXPECT_EQ(toString(stagesFromString("rigid,nonrigid")), "rigid,nonrigid");
  EXPECT_EQ(toString(stagesFromString("nonrigid")), "nonrigid");
}

TEST(Stages, RefuseUnknownRepeatedReversedAndMissingNames) {
  for (const char* names : {"", "refined", "rigid,rigid", "nonrigid,rigid", "Rigid", ","}) {
    EXPECT_THROW(stagesFromString(names), std::invalid_argument) << names;
  }
}

TEST(Pairing, NamesRoundTripAndUnknownOnesAreRefused) {
  for (const Pairing pairing :
       {Pairing::kNearest, Pairing::kOffsets, Pairing::kNone, Pairing::kRow}) {
    EXPECT_EQ(pairingFromString(toString(pairing)), pairing);
  }
  EXPECT_THROW(pairingFromString("closest"), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
