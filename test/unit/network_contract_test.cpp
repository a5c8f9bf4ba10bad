// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "network_inputs.hpp"

namespace unirit {
namespace {

using test::loudWeights;
using test::randomPoints;

/// The sentence of the exception that `work` must throw.
template <class Exception, class Work>
std::string sentenceOf(const Work& work) {
  try {
    work();
  } catch (const Exception& exception) {
    return exception.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

void expectMentions(const std::string& sentence, const std::string& words) {
  EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
}

TEST(NetworkContract, weightsOfAnotherPairingAreRefused) {
  NetworkSettings settings;
  settings.pairing = Pairing::kNone;
  const auto sentence = sentenceOf<std::invalid_argument>(
      [&] { Network(loudWeights(Pairing::kNearest), settings, 1); });
  expectMentions(sentence, "pairing");
  expectMentions(sentence, "none");
  expectMentions(sentence, "nearest");
}

TEST(NetworkContract, unusableArgumentsOfTheConstructorAreNamed) {
  const auto weights = loudWeights(NetworkSettings().pairing);
  expectMentions(sentenceOf<std::invalid_argument>([&] { Network(nullptr, {}, 1); }), "weights");
  expectMentions(sentenceOf<std::invalid_argument>([&] { Network(weights, {}, 0); }), "threads");
  NetworkSettings settings;
  settings.rigid_iterations = 0;
  expectMentions(sentenceOf<std::invalid_argument>([&] { Network(weights, settings, 1); }),
                 "rigid_iterations");
  const auto damaged = std::make_shared<Weights>(*weights);
  damaged->layers.erase("flow.decoder.3");
  expectMentions(sentenceOf<std::invalid_argument>([&] { Network(damaged, {}, 1); }),
                 "flow.decoder.3");
}

TEST(NetworkContract, cloudsThatAreEmptyOrNotFiniteAreNamed) {
  Network network(loudWeights(NetworkSettings().pairing), {}, 1);
  const Points good = randomPoints(9, 1);
  Points bad = good;
  bad(1, 4) = std::numeric_limits<float>::quiet_NaN();
  const Points empty(3, 0);
  for (const Points& cloud : {empty, bad}) {
    const auto refuse = [&](const Points& source, const Points& target, const std::string& name) {
      expectMentions(
          sentenceOf<std::invalid_argument>([&] { network.estimateRigid(source, target); }), name);
      expectMentions(sentenceOf<std::invalid_argument>(
                         [&] { network.estimateDisplacements(source, target, good); }),
                     name);
    };
    refuse(cloud, good, "source");
    refuse(good, cloud, "target");
  }
  expectMentions(
      sentenceOf<std::invalid_argument>([&] { network.estimateDisplacements(good, good, bad); }),
      "queries");
  EXPECT_NO_THROW(network.estimateRigid(good, good));
}

TEST(NetworkContract, pairingRowNeedsRowsThatBelongTogether) {
  NetworkSettings settings;
  settings.pairing = Pairing::kRow;
  Network network(loudWeights(Pairing::kRow), settings, 1);
  const Points source = randomPoints(9, 1);
  const Points target = randomPoints(9, 2);
  EXPECT_NO_THROW(network.estimateDisplacements(source, target, source));
  EXPECT_THROW(network.estimateDisplacements(source, randomPoints(8, 2), source),
               std::invalid_argument);
  EXPECT_THROW(network.estimateDisplacements(source, target, randomPoints(8, 1)),
               std::invalid_argument);
  EXPECT_THROW(network.estimateDisplacements(source, target, target), std::invalid_argument);
}

TEST(NetworkContract, aQuaternionOfZerosIsAnErrorNotARotation) {
  auto weights = std::make_shared<Weights>(randomWeights(Pairing::kNearest, 1));
  Layer& last = weights->layers.at("rigid.decoder.5");
  last.weight.setZero();
  last.bias.setZero();
  Network network(weights, {8, Pairing::kNearest}, 1);
  const Points cloud = randomPoints(9, 1);
  expectMentions(sentenceOf<std::runtime_error>([&] { network.estimateRigid(cloud, cloud); }),
                 "quaternion");
}

TEST(NetworkContract, aFlowThatOverflowsIsAnErrorNotADisplacement) {
  auto weights = std::make_shared<Weights>(randomWeights(Pairing::kOffsets, 1));
  weights->layers.at("flow.decoder.3").bias.setConstant(3e38F);
  Network network(weights, {8, Pairing::kOffsets}, 1);
  const Points source = randomPoints(9, 1), target = randomPoints(9, 2);
  expectMentions(sentenceOf<std::runtime_error>([&] { network.estimateRigid(source, target); }),
                 "not finite");
  expectMentions(sentenceOf<std::runtime_error>(
                     [&] { network.estimateDisplacements(source, target, source); }),
                 "not finite");
}

TEST(NetworkContract, theRotationStaysARotation) {
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    const int iterations = pairing == Pairing::kOffsets ? 4 : 32;
    Network network(loudWeights(pairing), {iterations, pairing}, 1);
    const Eigen::Matrix3f rotation =
        network.estimateRigid(randomPoints(30, 1), randomPoints(30, 2)).linear();
    EXPECT_LT((rotation * rotation.transpose() - Eigen::Matrix3f::Identity()).norm(), 1e-6F);
    EXPECT_GT(rotation.determinant(), 0.0F);
  }
}

TEST(NetworkContract, theFlowEndsWithAFineIterationOnceACoarseOneHardlyMoves) {
  auto still = std::make_shared<Weights>(randomWeights(Pairing::kOffsets, 1));
  still->layers.at("flow.decoder.3").weight.setZero();
  const Points source = randomPoints(40, 1), target = randomPoints(40, 2);
  const auto iterationsOf = [&](int at_most) {
    std::vector<Eigen::Isometry3f> iterates;
    Network(still, {at_most, Pairing::kOffsets}, 1).estimateRigid(source, target, &iterates);
    return iterates.size();
  };
  EXPECT_EQ(iterationsOf(8), 2U);
  EXPECT_EQ(iterationsOf(1), 1U);
  still->layers.at("flow.decoder.3").bias[0] = 0.1F;  // three steps of it are too far
  EXPECT_EQ(iterationsOf(8), 8U);
}

TEST(NetworkContract, coarselyIsAllButTheFineIterationAndOfThePublishedLayersAll) {
  const Points source = randomPoints(40, 1), target = randomPoints(40, 2);
  for (const Pairing pairing : {Pairing::kOffsets, Pairing::kNearest}) {
    const auto weights = loudWeights(pairing);
    std::vector<Eigen::Isometry3f> iterates;
    Network(weights, {3, pairing}, 1).estimateRigid(source, target, &iterates);
    ASSERT_EQ(iterates.size(), 3U);
    const int coarse_ones = pairing == Pairing::kOffsets ? 2 : 3;
    const auto coarse =
        Network(weights, {coarse_ones, pairing}, 1).estimateRigidCoarsely(source, target);
    EXPECT_EQ(coarse.matrix(), iterates[coarse_ones - 1].matrix()) << toString(pairing);
    EXPECT_NE(coarse.matrix(), iterates[0].matrix()) << toString(pairing);
  }
}

TEST(NetworkContract, aTargetThatIsMirroredIsNotReachedByAReflection) {
  auto weights = std::make_shared<Weights>(randomWeights(Pairing::kOffsets, 1));
  Layer& last = weights->layers.at("flow.decoder.3");
  last.weight.setZero();
  last.bias = Eigen::VectorXf::Unit(last.bias.size(), 3);  // the flow is the nearest point's offset
  Points source = randomPoints(40, 1);
  source.row(2) *= 0.02F;
  const Points mirrored = Eigen::Vector3f(1, 1, -1).asDiagonal() * source;
  const Eigen::Isometry3f transform =
      Network(weights, {1, Pairing::kOffsets}, 1).estimateRigid(source, mirrored);
  EXPECT_LT((transform.matrix() - Eigen::Matrix4f::Identity()).norm(), 0.1F);
}

TEST(NetworkContract, randomWeightsStartAtTheIdentity) {
  const Weights weights = randomWeights(Pairing::kNearest, 1);
  for (const Eigen::Index i : {1, 2, 3, 4, 5, 6}) {
    EXPECT_EQ(weights.layers.at("rigid.decoder.5").bias[i], 0.0F);
  }
  EXPECT_EQ(weights.layers.at("rigid.decoder.5").bias[0], 1.0F);
  const Points cloud = randomPoints(100, 1);
  for (const Pairing pairing : {Pairing::kNearest, Pairing::kOffsets}) {
    const auto fresh = std::make_shared<Weights>(randomWeights(pairing, 1));
    const auto transform = Network(fresh, {1, pairing}, 1).estimateRigid(cloud, cloud);
    const double limit = pairing == Pairing::kOffsets ? 0.1 : 0.5;
    EXPECT_LT((transform.matrix() - Eigen::Matrix4f::Identity()).norm(), limit);
  }
}

TEST(NetworkContract, randomWeightsOfAPointAreHeardAmongTheFeatures) {
  constexpr double kOffset = 100.0;  // ten times the weights, squared
  const auto point_over_features = [](Pairing pairing, Eigen::Index first, Eigen::Index columns) {
    const Eigen::MatrixXf weight = randomWeights(pairing, 1).layers.at("nonrigid.decoder.0").weight;
    return weight.middleCols(first, columns).squaredNorm() /
           weight.middleCols(3, 2 * kFeatureSize).squaredNorm();
  };
  const Eigen::Index pair = 3 + 2 * kFeatureSize;
  EXPECT_NEAR(point_over_features(Pairing::kNone, 0, 3), 1.0, 0.1);
  EXPECT_NEAR(point_over_features(Pairing::kRow, 0, 3), 0.5, 0.05);
  EXPECT_NEAR(point_over_features(Pairing::kRow, pair, 3), 0.5, 0.05);
  EXPECT_NEAR(point_over_features(Pairing::kNearest, 0, 3), 0.5, 0.05);
  EXPECT_NEAR(point_over_features(Pairing::kNearest, pair, 3), kOffset * 0.5, kOffset * 0.05);

  const auto layers = randomWeights(Pairing::kOffsets, 1).layers;
  const auto offset_over_point = [&](const char* layer, Eigen::Index first) {
    const Eigen::MatrixXf& weight = layers.at(layer).weight;
    return weight.middleCols(first, 3).squaredNorm() / weight.leftCols(3).squaredNorm();
  };
  EXPECT_NEAR(offset_over_point("flow.target_encoder.0", 3), kOffset, 0.4 * kOffset);
  EXPECT_NEAR(offset_over_point("flow.source_encoder.0", kFlowFirstVector), kOffset, 0.4 * kOffset);
  EXPECT_NEAR(offset_over_point("flow.decoder.0", kFlowFirstVector), kOffset, 0.4 * kOffset);
}

TEST(NetworkContract, costsAreThoseOfThePaper) {
  const auto giga = [](int iterations, bool with_savings, Pairing pairing = Pairing::kNearest) {
    return 1e-9 * multiplyAdds(1024, 1024, iterations, pairing, with_savings);
  };
  const double encoder = 1e-9 * 1024 * 147648;
  EXPECT_NEAR(encoder, 0.1512, 0.00005);
  EXPECT_NEAR(giga(0, false) - 3 * encoder, 2.867, 0.0005);  // three encoders beside the decoder
  EXPECT_NEAR(giga(8, false), 4.56, 0.005);
  EXPECT_NEAR(giga(8, true), 2.41, 0.01);
  EXPECT_NEAR(giga(0, false) - encoder, 3.17, 0.005);  // with no iteration the target's is left
  EXPECT_NEAR(giga(8, false) - giga(0, false) + encoder, 1.393, 0.0005);
  EXPECT_LT(giga(8, true, Pairing::kNone), giga(8, true));
}

TEST(NetworkContract, coarseIterationsOfTheFlowReadFewerPoints) {
  const double encoders = (83 + 6) * 64 + 2 * (64 * 64 + 64 * 64 + 64 * 128 + 128 * 256),
               decoder = 83 * 128 + 2 * 128 * 128 + 128 * 22, global = 512 * 128;
  const auto cost = [](int iterations, bool with_savings) {
    return multiplyAdds(1024, 1024, iterations, Pairing::kOffsets, with_savings);
  };
  const double point = encoders + decoder;
  EXPECT_EQ(cost(8, true), 7 * 3 * (320 * point + global) + 9 * (1024 * point + global));
  EXPECT_EQ(cost(3, false), (2 * 3 * 320 + 9 * 1024) * (point + global));
}

TEST(Normalisation, putsTheSourceIntoTheUnitCube) {
  const Points source = (0.05F * randomPoints(50, 1)).colwise() + Eigen::Vector3f(1, 2, 3);
  const Normalisation normalisation = Normalisation::of(source);
  const Points unit = normalisation.apply(source);
  EXPECT_NEAR(unit.cwiseAbs().maxCoeff(), 1.0F, 1e-6F);
  EXPECT_LT(unit.rowwise().mean().norm(), 1e-4F);
  EXPECT_LT(((unit * normalisation.scale).colwise() + normalisation.offset - source).norm(), 1e-5F);
}

TEST(Normalisation, refusesCloudsWithoutALength) {
  EXPECT_THROW(Normalisation::of(Points(3, 0)), std::invalid_argument);
  EXPECT_THROW(Normalisation::of(Points::Ones(3, 1)), std::invalid_argument);
  EXPECT_THROW(Normalisation::of(Points::Ones(3, 5)), std::invalid_argument);
}

}  // namespace
}  // namespace unirit
