// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "shapes.hpp"
#include "unirit/evaluation/errors.hpp"
#include "unirit/evaluation/method_factory.hpp"

namespace unirit {
namespace {

/// A rigid case: turned by 15 degrees about the far end, 20 mm off, target shuffled.
RegistrationPair turnedOrgan() {
  RegistrationPair pair;
  pair.source = test::bumpyEllipsoid(500, 1);
  pair.interior = 0.5F * pair.source.leftCols(20);
  pair.best_rigid = Eigen::Translation3d(0.02, 0.0, -0.01) *
                    Eigen::AngleAxisd(0.26, Eigen::Vector3d(1, 1, 0).normalized());
  pair.truth = (pair.best_rigid * pair.source.cast<double>()).cast<float>();
  pair.interior_truth = (pair.best_rigid * pair.interior.cast<double>()).cast<float>();
  pair.surface = pair.truth;
  pair.target = test::shuffled(pair.truth, 2);
  return pair;
}

RegistrationErrors errorsOf(const std::string& description, const RegistrationPair& pair) {
  const auto method = MethodFactory("").make(description, Protocol::kCaseB);
  return registrationErrors(pair, method->registerPair(pair));
}

TEST(Methods, EveryRivalSolvesARigidCase) {
  const RegistrationPair pair = turnedOrgan();
  ASSERT_GT(registrationErrors(pair, {false, pair.source, pair.interior, {}}).rmse, 0.02);
  for (const char* name : {"icp:centroids=1:max_distance=0.5", "gicp:centroids=1:max_distance=0.5",
                           "cpd-rigid", "cpd", "bcpd"}) {
    const RegistrationErrors errors = errorsOf(name, pair);
    EXPECT_LT(errors.rmse, 0.003) << name;
    EXPECT_LT(*errors.target, 0.003) << name;
    if (name != std::string("bcpd")) {  // it may turn by its displacements instead
      EXPECT_LT(errors.rotation.value_or(0.0), 2.0) << name;
    }
  }
}

TEST(Methods, AnswersDoNotDependOnTheTruth) {
  RegistrationPair pair = turnedOrgan(), blind = pair;
  blind.truth.setZero();
  blind.interior_truth.setZero();
  blind.surface.setZero();
  blind.best_rigid.setIdentity();
  MethodFactory factory("");
  for (const char* name : {"identity", "icp", "gicp", "cpd-rigid", "cpd", "bcpd"}) {
    const auto method = factory.make(name, Protocol::kCaseB);
    EXPECT_EQ(method->registerPair(pair).source, method->registerPair(blind).source) << name;
  }
  const auto oracle = factory.make("best-rigid", Protocol::kCaseB);
  EXPECT_NE(oracle->registerPair(pair).source, oracle->registerPair(blind).source);
  EXPECT_NE(oracle->name().find("oracle"), std::string::npos);
}

TEST(Methods, GivenKeysReplaceTunedSettingsAndAreReported) {
  MethodFactory factory("");
  const auto method = factory.make("cpd:beta=1.25:lambda=7", Protocol::kPartial);
  EXPECT_EQ(method->name(), "cpd");
  EXPECT_NE(method->parameters().find("beta=1.25:lambda=7:"), std::string::npos);
  EXPECT_NE(method->parameters(), factory.make("cpd", Protocol::kPartial)->parameters());
}

TEST(Methods, FaultyDescriptionsAreRefusedByName) {
  MethodFactory factory("");
  for (const char* description :
       {"cdp", "cpd:beta", "cpd:beta=wide", "cpd:gamma=1", "identity:beta=1", "unirit",
        "unirit:weights=none:start=identity"}) {
    EXPECT_ANY_THROW(factory.make(description, Protocol::kCaseB)) << description;
  }
}

TEST(Methods, UniritIsToldByItsStagesAndWeights) {
  const std::string path =
      (std::filesystem::temp_directory_path() / "methods_test.safetensors").string();
  writeWeights(randomWeights(NetworkSettings().pairing, 1), path);
  MethodFactory factory(path);
  const auto rigid = factory.make("unirit:stages=rigid", Protocol::kCaseB);
  const auto all = factory.make("unirit:stages=rigid+nonrigid", Protocol::kCaseB);
  EXPECT_EQ(rigid->name(), "unirit rigid");
  EXPECT_EQ(all->name(), "unirit rigid+nonrigid");
  EXPECT_NE(rigid->parameters(), all->parameters());
  EXPECT_NE(all->parameters().find(readWeights(path).sha256), std::string::npos);
  std::filesystem::remove(path);
}

TEST(Methods, RowsAreReadByUniritRowsAlone) {
  const std::string path =
      (std::filesystem::temp_directory_path() / "methods_rows_test.safetensors").string();
  MethodFactory factory(path);
  writeWeights(randomWeights(Pairing::kRow, 1), path);
  RegistrationPair pair = turnedOrgan();
  pair.target = pair.truth;
  const auto rows = factory.make("unirit-rows", Protocol::kPaired);
  const Points in_order = rows->registerPair(pair).source;
  pair.target = test::shuffled(pair.target, 3);
  EXPECT_NE(rows->registerPair(pair).source, in_order);
  EXPECT_THROW(factory.make("unirit", Protocol::kPaired), std::invalid_argument);
  EXPECT_THROW(factory.make("unirit-rows:stages=rigid", Protocol::kPaired), std::invalid_argument);

  writeWeights(randomWeights(NetworkSettings().pairing, 1), path);
  EXPECT_THROW(MethodFactory(path).make("unirit-rows", Protocol::kPaired), std::invalid_argument);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace unirit
