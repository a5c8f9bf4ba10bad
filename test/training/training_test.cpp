// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "difference.hpp"
#include "trainer.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit::training {
namespace {

namespace fs = std::filesystem;

/// A folder of the test's own, removed afterwards.
class Training : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() /
        (std::string("unirit_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    settings_.pairing = Pairing::kOffsets;
    settings_.batch.pairs = 4;
    settings_.batch.points = 32;
    settings_.iterations = 4;
    settings_.steps = 6;
    settings_.report_every = 3;
    settings_.save_every = 3;
  }
  void TearDown() override { fs::remove_all(folder_); }

  Weights trained(const TrainingSettings& settings, const fs::path& folder) {
    Unirit model(settings.pairing);
    model->setWeights(randomWeights(settings.pairing, 1));
    return train(organs_, organs_, settings, folder, model,
                 [&](const Progress& progress) { last_ = progress; })
        ->weights();
  }

  /// Those of which every layer is another after training; the others' are the same.
  std::set<std::string> trainedModules() {
    const Weights before = randomWeights(settings_.pairing, 1);
    const Weights after = trained(settings_, folder_ / std::to_string(++trainings_));
    std::set<std::string> changed, unchanged;
    for (const auto& [name, layer] : after.layers) {
      const bool same = layer.weight == before.layers.at(name).weight;
      (same ? unchanged : changed).insert(name.substr(0, name.find('.')));
    }
    for (const std::string& module : changed) EXPECT_EQ(unchanged.count(module), 0U) << module;
    return changed;
  }

  fs::path folder_;
  int trainings_ = 0;
  TrainingSettings settings_;
  Progress last_;
  const std::vector<Organ> organs_{{"liver", "1", makePhantom("liver", 1, 1000)}};
};

TEST_F(Training, BatchesDependOnSeedAndNumberAlone) {
  const Batch a = makeBatch(organs_, settings_.batch, 1, 5),
              b = makeBatch(organs_, settings_.batch, 1, 5);
  EXPECT_TRUE(torch::equal(a.source, b.source) && torch::equal(a.target, b.target));
  EXPECT_FALSE(torch::equal(a.target, makeBatch(organs_, settings_.batch, 1, 6).target));
  BatchQueue queue(organs_, settings_.batch, 1, 4, 3);
  queue.next();
  EXPECT_TRUE(torch::equal(queue.next().target, a.target));
}

TEST_F(Training, QueuesPassOnWhatGoesWrong) {
  const std::vector<Organ> flat{
      {"liver", "2", {{Points::Zero(3, 3), Points()}, Eigen::Matrix3Xi::Zero(3, 1)}}};
  BatchQueue queue(flat, settings_.batch, 1, 0, 2);
  EXPECT_THROW(queue.next(), std::invalid_argument);
}

TEST_F(Training, BatchesAreNormalisedAndTheBestRigidFitIsNearerThanNone) {
  settings_.batch.pairs = 16;
  const Batch batch = makeBatch(organs_, settings_.batch, 2, 0);
  EXPECT_NEAR(batch.source.abs().max().item<float>(), 1.0F, 1e-5F);
  EXPECT_NEAR(batch.source.mean(1).abs().max().item<float>(), 0.0F, 1e-5F);
  const auto before = (batch.source - batch.truth).square().sum();
  const auto after = (batch.rigid - batch.truth).square().sum();
  EXPECT_LT(after.item<float>(), before.item<float>());
}

TEST_F(Training, LearnsToTranslate) {
  settings_.batch.pairs = 8;
  settings_.batch.rotation = settings_.batch.common_rotation = 0.0;
  settings_.batch.partial_share = settings_.batch.centred_share = 0.0;
  settings_.batch.translation = 0.75;  // far more than the deformation, which is left
  settings_.alpha = 0.0;
  settings_.iterations = 1;
  settings_.learning_rate = 1e-3;
  settings_.steps = 150;
  settings_.report_every = 15;
  double first = 0.0;
  Unirit model(settings_.pairing);
  model->setWeights(randomWeights(settings_.pairing, 1));
  train(organs_, organs_, settings_, folder_, model, [&](const Progress& progress) {
    if (first == 0.0) first = progress.loss;
    last_ = progress;
  });
  EXPECT_LT(last_.loss, 0.6 * first);
}

TEST_F(Training, GoesOnFromItsCheckpointAsIfItHadNotStopped) {
  const Weights whole = trained(settings_, folder_ / "whole");
  struct CutOff {};
  Unirit model(settings_.pairing);
  model->setWeights(randomWeights(settings_.pairing, 1));
  const auto cut_off = [](const Progress& progress) {
    if (progress.step > 3) throw CutOff();  // after the checkpoint of step 3, before the next
  };
  const fs::path folder = folder_ / "cut";
  EXPECT_THROW(train(organs_, organs_, settings_, folder, model, cut_off), CutOff);
  EXPECT_EQ(difference(trained(settings_, folder), whole), 0.0);
  EXPECT_EQ(last_.step, settings_.steps);

  last_ = {};
  EXPECT_EQ(difference(trained(settings_, folder), whole), 0.0) << "finished: nothing left to do";
  EXPECT_EQ(last_.step, 0);
}

TEST_F(Training, LearnsOnACudaDeviceWhatItLearnsOnTheCpu) {
  if (!torch::cuda::is_available()) GTEST_SKIP() << "no CUDA device";
  trained(settings_, folder_ / "cpu");
  const double loss = last_.loss;
  settings_.device = torch::kCUDA;
  const Weights on_cuda = trained(settings_, folder_ / "cuda");
  EXPECT_NEAR(last_.loss, loss, 1e-3 * loss);
  EXPECT_GT(difference(on_cuda, randomWeights(settings_.pairing, 1)), 0.0);
}

TEST_F(Training, PairedTargetsAreTheTruthRowByRow) {
  settings_.batch.target = View::Target::kPaired;
  settings_.batch.partial_share = 0.0;
  const Batch batch = makeBatch(organs_, settings_.batch, 3, 0);
  EXPECT_TRUE(torch::allclose(batch.target, batch.truth, 1e-4, 1e-5));
}

TEST_F(Training, NearPairsAreNotRotated) {
  settings_.batch.pairs = 16;
  const auto largestTurn = [&](double near_share) {
    settings_.batch.near_share = near_share;
    const Batch batch = makeBatch(organs_, settings_.batch, 4, 0);
    return (batch.rigid - batch.source).norm(2, 2).max().item<float>();
  };
  EXPECT_GT(largestTurn(0.0), 0.5F);
  EXPECT_LT(largestTurn(1.0), 0.4F);
}

TEST_F(Training, LeavesOneModuleAloneWhereAlphaIsOneAndTheOtherWhereItIsZero) {
  settings_.pairing = Pairing::kNearest;
  settings_.alpha = 0.0;
  EXPECT_EQ(trainedModules(), (std::set<std::string>{"rigid"}));
  settings_.alpha = 1.0;
  EXPECT_EQ(trainedModules(), (std::set<std::string>{"nonrigid"}));
}

TEST_F(Training, LearnsFromTheDistanceToTheTargetAlone) {
  settings_.loss = Loss::kPaper;
  EXPECT_EQ(trainedModules(), (std::set<std::string>{"flow"}));
}

TEST_F(Training, TrainsTheFlowModuleInEitherStage) {
  for (const double alpha : {0.0, 1.0}) {
    settings_.alpha = alpha;
    EXPECT_EQ(trainedModules(), (std::set<std::string>{"flow"}));
  }
}

TEST_F(Training, LearnsFromAsManyPointsAsAskedFor) {
  settings_.pairing = Pairing::kNearest;
  const Weights of_all = trained(settings_, folder_ / "all");
  settings_.decoded_points = 7;
  const Weights of_some = trained(settings_, folder_ / "some");
  EXPECT_GT(difference(of_all, of_some), 0.0);
}

TEST_F(Training, PartsOfABatchTeachWhatTheWholeTeaches) {
  settings_.steps = settings_.report_every = settings_.save_every = 1;
  const auto lossInParts = [&](int threads) {
    settings_.threads = threads;
    trained(settings_, folder_ / std::to_string(threads));
    return last_.loss;
  };
  const double whole = lossInParts(1);
  EXPECT_NEAR(lossInParts(3), whole, 1e-4 * whole);
}

TEST_F(Training, WritesCurvesAndRefusesDamagedAndOtherCheckpoints) {
  trained(settings_, folder_);
  std::ifstream curves(folder_ / "curves.csv");
  std::string line;
  int lines = 0;
  while (std::getline(curves, line)) ++lines;
  EXPECT_EQ(lines, 1 + 2);
  const auto expectRefused = [&](const std::string& sentence) {
    try {
      trained(settings_, folder_);
      FAIL() << "the checkpoint was taken";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(sentence), std::string::npos) << error.what();
    }
  };
  settings_.pairing = Pairing::kRow;
  expectRefused("checkpoint.pt: its network's pairing is another");
  std::ofstream(folder_ / "checkpoint.pt") << "not a checkpoint";
  expectRefused("checkpoint.pt: not a checkpoint");
}

}  // namespace
}  // namespace unirit::training
