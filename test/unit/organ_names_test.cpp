// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/organ_names.hpp"

#include <gtest/gtest.h>

namespace unirit {
namespace {

TEST(OrganNames, AreFoundAnywhereInAFileNameInAnyCase) {
  const std::pair<const char*, const char*> names[] = {
      {"s0123_liver", "liver"},
      {"000017_heart_atrium_left", "atrium"},
      {"s0123_LIVER_7", "liver"},
      {"GallBladder", "gallbladder"},
      {"042_gall_bladder", "gallbladder"},
      {"s0009_kidney_left", "kidney"},
      {"KidneyRight-3", "kidney"},
      {"small_bowel.nii", "small_bowel"},
      {"001812_Small_Intestine", "small_bowel"},
      {"kits19_00003_kidney_tumor", "kidney_tumor"},
      {"brats_0001_brain_minus_tumor", "brain_tumor"},
      {"liver01", "liver"},
      {"urinary_bladder", "urinary_bladder"},
  };
  for (const auto& [name, organ] : names) {
    const OrganGuess guess = organInFileName(name);
    EXPECT_EQ(guess.organ, organ) << name << ": " << guess.problem;
    EXPECT_EQ(guess.problem, "");
  }
}

TEST(OrganNames, AmbiguousAndUnknownFileNamesSaySo) {
  const std::pair<const char*, const char*> names[] = {
      {"liver_and_spleen", "ambiguous: it names both liver and spleen"},
      {"s01_liver_vessels", "ambiguous: it names liver and vessels"},
      {"pancreas_tumor", "ambiguous: it names pancreas and tumor"},
      {"s01_femur_left", "no organ"},
      {"delivery", "no organ"},  // holds "liver", but not as a word
      {"0123", "no organ"},
      {"", "no organ"},
  };
  for (const auto& [name, words] : names) {
    const OrganGuess guess = organInFileName(name);
    EXPECT_EQ(guess.organ, "") << name;
    EXPECT_NE(guess.problem.find(words), std::string::npos) << name << ": " << guess.problem;
  }
}

TEST(OrganNames, OfFoldersAreSynonymsAsAWholeOrStand) {
  EXPECT_EQ(organOfFolder("Small_Intestine"), "small_bowel");
  EXPECT_EQ(organOfFolder("kidney_tumor"), "kidney_tumor");
  EXPECT_EQ(organOfFolder("phantom_liver"), "phantom_liver");
  EXPECT_EQ(organOfFolder("liver_2"), "liver");
}

TEST(OrganNames, OfCasesArePartedFromTheSubjectAtTheLongestClass) {
  using Parts = std::pair<std::string, std::string>;
  EXPECT_EQ(splitOrganAndSubject("kidney_tumor_kits19_00003"),
            Parts("kidney_tumor", "kits19_00003"));
  EXPECT_EQ(splitOrganAndSubject("kidney_kits19_00003R"), Parts("kidney", "kits19_00003R"));
  EXPECT_EQ(splitOrganAndSubject("femur_left_1"), Parts("femur", "left_1"));
  EXPECT_EQ(splitOrganAndSubject("femur"), Parts("femur", ""));
}

}  // namespace
}  // namespace unirit
