// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/pair_builder.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <stdexcept>

#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

OrganSource source(const std::string& organ, int patient) {
  const std::string number = std::to_string(patient);
  return {organ, number, organ + "/" + number, [organ, patient] {
            return LoadedOrgan{makePhantom(organ, static_cast<std::uint64_t>(patient), 800),
                               "hash of " + organ};
          }};
}

OrganSource broken() {
  return {"liver", "broken", "liver/broken.ply",
          []() -> LoadedOrgan { throw std::runtime_error("liver/broken.ply: is no mesh"); }};
}

PairSettings settings() {
  PairSettings settings;
  settings.protocols = {Protocol::kCaseB, Protocol::kPartial};
  settings.points = 64;
  settings.surface_samples = 100;
  settings.deformations = 2;
  settings.variations = 1;
  return settings;
}

BuiltPairs build(const std::vector<OrganSource>& sources, const PairSettings& settings) {
  return buildPairs(sources, settings, [](std::size_t, std::size_t) {});
}

void expectEqual(const PairSetCase& a, const PairSetCase& b) {
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.subject, b.subject);
  EXPECT_EQ(a.seen.points.truth, b.seen.points.truth);
  for (std::size_t k = 0; k < a.seen.sights.size(); ++k) {
    EXPECT_EQ(a.seen.sights[k].target, b.seen.sights[k].target);
  }
}

TEST(PairBuilder, MakesTheSameBitsOnAnyNumberOfThreads) {
  const std::vector<OrganSource> sources{source("liver", 0), source("kidney", 1), broken(),
                                         source("spleen", 2), source("liver", 3)};
  PairSettings several = settings();
  several.threads = 4;
  const BuiltPairs one = build(sources, settings()), four = build(sources, several);
  ASSERT_EQ(one.set.cases.size(), 4U * 2U * 2U);
  ASSERT_EQ(four.set.cases.size(), one.set.cases.size());
  for (std::size_t i = 0; i < one.set.cases.size(); ++i) {
    expectEqual(one.set.cases[i], four.set.cases[i]);
  }
}

TEST(PairBuilder, MakesTheSameCasesOfASourceWhateverTheOthers) {
  const BuiltPairs alone = build({source("kidney", 1)}, settings());
  const BuiltPairs among = build({source("liver", 0), source("kidney", 1)}, settings());
  for (std::size_t i = 0; i < 4; ++i) expectEqual(alone.set.cases[i], among.set.cases[4 + i]);
}

TEST(PairBuilder, GivesEveryCaseASeedOfItsOwn) {
  PairSettings other = settings();
  other.seed = 2;
  const std::vector<OrganSource> sources{source("liver", 0), source("liver", 1)};
  std::set<std::uint64_t> seeds;
  for (const PairSettings& used : {settings(), other}) {
    for (const PairSetCase& one : build(sources, used).set.cases) seeds.insert(one.seed);
  }
  EXPECT_EQ(seeds.size(), 2U * 8U);
}

TEST(PairBuilder, CountsVariationsAndDeformations) {
  const BuiltPairs pairs = build({source("liver", 0)}, settings());
  std::string counted;
  for (const PairSetCase& one : pairs.set.cases) {
    counted += std::to_string(one.variation) + "." + std::to_string(one.deformation) + " ";
  }
  EXPECT_EQ(counted, "0.0 0.1 1.0 1.1 ");
  EXPECT_NE(extent(pairs.set.cases[0].seen.points.source),
            extent(pairs.set.cases[2].seen.points.source));
}

TEST(PairBuilder, FillsUpClassesThatHaveFewSubjects) {
  PairSettings balanced = settings();
  balanced.deformations = 1;
  balanced.variations = 0;
  balanced.subjects = 4;
  OrganSource small = source("gallbladder", 0);
  small.organ = "liver";  // rejected, so it counts for nothing
  std::vector<OrganSource> sources{small, source("liver", 1), source("liver", 2),
                                   source("liver", 3), source("kidney", 1)};
  for (int patient = 0; patient < 5; ++patient) sources.push_back(source("spleen", patient));
  std::map<std::string, std::string> counted;
  for (const PairSetCase& one : build(sources, balanced).set.cases) {
    counted[one.organ] += one.subject + "." + std::to_string(one.variation) + " ";
  }
  EXPECT_EQ(counted["liver"], "1.0 1.1 2.0 3.0 ");
  EXPECT_EQ(counted["kidney"], "1.0 1.1 1.2 1.3 ");
  EXPECT_EQ(counted["spleen"], "0.0 1.0 2.0 3.0 4.0 ");
}

TEST(PairBuilder, ListsWhatItLeavesOutAndGoesOn) {
  OrganSource small = source("gallbladder", 0);
  small.organ = "liver";  // far too small for one
  std::size_t told = 0;
  const BuiltPairs pairs = buildPairs({broken(), small, source("liver", 1)}, settings(),
                                      [&](std::size_t done, std::size_t total) {
                                        EXPECT_EQ(done, ++told);
                                        EXPECT_EQ(total, 3U);
                                      });
  EXPECT_EQ(told, 3U);
  ASSERT_EQ(pairs.sources.size(), 3U);
  EXPECT_EQ(pairs.sources[0].rejected, std::vector<std::string>{"liver/broken.ply: is no mesh"});
  ASSERT_EQ(pairs.sources[1].rejected.size(), 1U);
  EXPECT_NE(pairs.sources[1].rejected[0].find("gallbladder/0: is "), std::string::npos);
  EXPECT_EQ(pairs.sources[1].sha256, "hash of gallbladder");
  EXPECT_TRUE(pairs.sources[2].rejected.empty());
  EXPECT_EQ(pairs.sources[2].cases, 4U);
  EXPECT_EQ(pairs.set.cases.size(), 4U);
}

TEST(PairBuilder, NamesTheSurfaceThatCannotBeDeformed) {
  OrganSource flat = source("liver", 1);
  flat.load = [] {
    LoadedOrgan organ{makePhantom("liver", 1, 800), ""};
    organ.surface.vertices.points.row(2).setZero();
    return organ;
  };
  const BuiltPairs pairs = build({flat, source("kidney", 1)}, settings());
  ASSERT_EQ(pairs.sources[0].rejected.size(), 1U);
  EXPECT_EQ(pairs.sources[0].rejected[0].rfind("liver/1: ", 0), 0U) << pairs.sources[0].rejected[0];
  EXPECT_EQ(pairs.set.cases.size(), 4U);
}

TEST(PairBuilder, RefusesSettingsThatMakeNoPairs) {
  PairSettings wrong = settings();
  wrong.protocols.clear();
  EXPECT_THROW(build({}, wrong), std::invalid_argument);
  wrong = settings();
  wrong.deformations = 0;
  EXPECT_THROW(build({}, wrong), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
