// SPDX-License-Identifier: BSD-3-Clause
#include "refinement/coherent_field.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "refinement_problem.hpp"
#include "unirit/metrics.hpp"

namespace unirit {
namespace {

using test::kOrgans;
using test::Outcome;
using test::pairOf;
using test::Problem;

TEST(CoherentField, MovesAsTheRefinementDid) {
  const Problem problem(pairOf("liver", Protocol::kResampled, 1));
  const Outcome outcome(problem);
  const Eigen::Matrix3f rotation = outcome.refined.pose.linear();
  const CoherentField field(outcome.refinement.prior(), problem.normalisation, rotation,
                            outcome.refined.coefficients, outcome.refined.covariance_factor);
  const Points metres = (problem.normalisation.scale * problem.source.points).colwise() +
                        problem.normalisation.offset;
  const Points expected =
      problem.normalisation.scale * (outcome.moved - outcome.refined.pose * problem.source.points);
  EXPECT_LT((field.displacements(metres) - expected).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.001F);
}

TEST(CoherentField, SaysTheSameWhereTheFunctionsAreKnownOnAnyNumberOfThreads) {
  const RegistrationPair pair = pairOf("liver", Protocol::kPartial, 1);
  const Problem problem(pair);
  const Outcome outcome(problem);
  const auto& prior = outcome.refinement.prior();
  const CoherentField field(prior, problem.normalisation, outcome.refined.pose.linear(),
                            outcome.refined.coefficients, outcome.refined.covariance_factor);
  const Points organ = problem.normalisation.apply(pair.source);
  ThreadTeam alone(1);
  const Eigen::MatrixXf functions = prior->functions(organ);
  const FieldValues values = field.valuesAt(functions, alone);
  EXPECT_LT((values.displacements - field.displacements(pair.source)).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_EQ(values.confidence, field.confidence(pair.source));
  for (const int threads : {2, 3}) {
    ThreadTeam team(threads);
    EXPECT_EQ(prior->functions(organ, team), functions);
    const FieldValues others = field.valuesAt(functions, team);
    EXPECT_EQ(others.displacements, values.displacements);
    EXPECT_EQ(others.confidence, values.confidence);
  }
}

TEST(CoherentField, IsSurerOfWhatWasSeen) {
  for (const char* organ : kOrgans) {
    const RegistrationPair pair = pairOf(organ, Protocol::kPartial, 1);
    const Problem problem(pair);
    const Outcome outcome(problem);
    const CoherentField field(outcome.refinement.prior(), problem.normalisation,
                              outcome.refined.pose.linear(), outcome.refined.coefficients,
                              outcome.refined.covariance_factor);
    const Eigen::RowVectorXf confidence = field.confidence(pair.source);
    EXPECT_GE(confidence.minCoeff(), 0.0F);
    EXPECT_LE(confidence.maxCoeff(), 1.0F);
    const Eigen::RowVectorXf distances = nearestDistances(pair.truth, pair.target);
    const std::vector<float> values(distances.data(), distances.data() + distances.size());
    const auto meanWhere = [&](const auto& chosen) {
      return (confidence.array() * chosen.template cast<float>()).sum() /
             static_cast<float>(chosen.count());
    };
    const auto nearest = static_cast<float>(quantile(values, 0.25));
    const auto farthest = static_cast<float>(quantile(values, 0.75));
    const float observed = meanWhere(distances.array() < nearest);
    const float hidden = meanWhere(distances.array() > farthest);
    EXPECT_GT(observed, hidden + 0.2F) << organ;
    const Points far = pair.source.leftCols(5).array() + 10.0F;
    EXPECT_LT(field.confidence(far).maxCoeff(), 1e-6F);
  }
}

}  // namespace
}  // namespace unirit
