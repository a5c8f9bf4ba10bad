// SPDX-License-Identifier: BSD-3-Clause
#include "model.hpp"

#include <gtest/gtest.h>

#include "difference.hpp"
#include "max_linear.hpp"
#include "surroundings.hpp"

namespace unirit::training {
namespace {

TEST(MaxLinear, HasTheValueAndGradientsOfTheDenseOperation) {
  torch::manual_seed(1);
  // in floats by loops, in doubles by whole tensors, as on a graphics processor
  for (const auto type : {torch::kFloat32, torch::kFloat64}) {
    const auto options = torch::TensorOptions(type).requires_grad(true);
    const auto values = torch::randn({3, 20, 8}, options), weight = torch::randn({16, 8}, options),
               bias = torch::randn({16}, options);
    const auto direction = torch::randn({3, 16}, type);
    const auto sparse = maxLinear(values, weight, bias);
    const auto dense = std::get<0>(torch::linear(values, weight, bias).max(1));
    EXPECT_TRUE(torch::allclose(sparse, dense, 1e-5, 1e-6));
    const auto a = torch::autograd::grad({(sparse * direction).sum()}, {values, weight, bias});
    const auto b = torch::autograd::grad({(dense * direction).sum()}, {values, weight, bias});
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(torch::allclose(a[i], b[i], 1e-4, 1e-5));
  }
}

TEST(Model, WeightsRoundTrip) {
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    const Weights weights = randomWeights(pairing, 2);
    Unirit model(pairing);
    model->setWeights(weights);
    EXPECT_EQ(difference(weights, model->weights()), 0.0);
  }
}

TEST(Model, RefusesWeightsThatDoNotFit) {
  Unirit model(Pairing::kNearest);
  Weights incomplete = randomWeights(Pairing::kNearest, 2);
  incomplete.layers.erase("rigid.decoder.0");
  EXPECT_THROW(model->setWeights(incomplete), std::invalid_argument);
  EXPECT_THROW(model->setWeights(randomWeights(Pairing::kNone, 2)), std::invalid_argument);
}

/// Of radius 0.5; their normals no rounding turns.
torch::Tensor onSpheres(std::int64_t clouds, std::int64_t points) {
  const auto along_rows = torch::nn::functional::NormalizeFuncOptions().dim(2);
  return 0.5 * torch::nn::functional::normalize(torch::randn({clouds, points, 3}), along_rows);
}

TEST(Model, ReadsTheSurroundingsAlikeOnEveryDevice) {
  torch::manual_seed(1);
  const auto source = onSpheres(2, 50), target = onSpheres(2, kFlowPlanes + 44);
  const auto deformation = 0.1 * torch::randn({2, 50, 3});
  const Surroundings a = surroundings(source, deformation, target),
                     b = onAnyDevice(source, deformation, target);
  EXPECT_TRUE(torch::allclose(a.of_source, b.of_source, 1e-4, 1e-5));
  EXPECT_TRUE(torch::allclose(a.of_target, b.of_target, 1e-4, 1e-5));
}

TEST(Model, EveryPairOfABatchStopsByItself) {
  torch::manual_seed(1);
  const torch::NoGradGuard no_grad;
  Weights weights = randomWeights(Pairing::kOffsets, 2);
  weights.layers.at("flow.decoder.3").weight *= 3.0F;
  Unirit model(Pairing::kOffsets);
  model->setWeights(weights);
  const auto source = onSpheres(4, 60);
  const auto target =
      source + 0.1 * torch::arange(4).view({4, 1, 1});  // the first is there already
  const auto together = model->moveRigidly(source, target, 3);
  const auto earlier = model->moveRigidly(source, target, 2);
  for (std::int64_t pair = 0; pair < 4; ++pair) {
    const auto alone =
        model->moveRigidly(source.slice(0, pair, pair + 1), target.slice(0, pair, pair + 1), 3);
    EXPECT_TRUE(torch::allclose(together[pair], alone[0], 1e-4, 1e-5)) << pair;
    const bool goes_on = pair >= 2;
    EXPECT_EQ(torch::allclose(together[pair], earlier[pair], 1e-4, 1e-5), !goes_on) << pair;
  }
}

TEST(Model, TheBestRigidFitFindsAPoseAndNoReflection) {
  torch::manual_seed(1);
  const auto points = torch::randn({2, 20, 3});
  const auto turn = torch::tensor({{0.0F, -1.0F, 0.0F}, {1.0F, 0.0F, 0.0F}, {0.0F, 0.0F, 1.0F}});
  const Pose pose{turn.expand({2, 3, 3}), torch::randn({2, 3})};
  const auto moved = pose.apply(points);
  EXPECT_TRUE(torch::allclose(bestRigidFit(points, moved).apply(points), moved, 1e-4, 1e-5));
  const Pose mirrored = bestRigidFit(points, points * torch::tensor({1.0F, 1.0F, -1.0F}));
  EXPECT_TRUE(torch::allclose(torch::linalg_det(mirrored.rotation), torch::ones({2}), 1e-4, 1e-5));
}

TEST(Model, DecodesAsManyPointsAsAskedFor) {
  const torch::NoGradGuard no_grad;
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kNone, Pairing::kRow}) {
    Unirit model(pairing);
    const auto source = torch::randn({2, 40, 3}), target = torch::randn({2, 40, 3});
    const auto all = model->nonrigid->forward(source, target);
    const auto some = model->nonrigid->forward(source, target, 7);
    EXPECT_TRUE(torch::allclose(some, all.slice(1, 0, 7), 1e-5, 1e-6)) << toString(pairing);
  }
}

}  // namespace
}  // namespace unirit::training
