// SPDX-License-Identifier: BSD-3-Clause
#include "refinement/refinement.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "allocation_counter.hpp"
#include "refinement/coherent_field.hpp"
#include "shapes.hpp"
#include "unirit/evaluation/pair.hpp"
#include "unirit/metrics.hpp"
#include "unirit/network/network.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

const char* const kOrgans[] = {"liver", "kidney", "spleen"};

RegistrationPair pairOf(const std::string& organ, Protocol protocol, std::uint64_t seed) {
  return makePair(makePhantom(organ, seed, 3000), protocol, 1024, seed);
}

/// A pair in the network's unit, as a Refinement takes it.
struct Problem {
  explicit Problem(const RegistrationPair& pair)
      : normalisation(Normalisation::of(pair.source)),
        source{normalisation.apply(pair.source), pair.source_normals},
        target{normalisation.apply(pair.target), {}} {
    if (pair.viewpoint) target.viewpoint = Points(normalisation.apply(*pair.viewpoint)).col(0);
  }

  void rotate(const Eigen::Matrix3f& rotation) {
    source.points = rotation * source.points;
    source.normals = rotation * source.normals;
    target.points = rotation * target.points;
    if (target.viewpoint) target.viewpoint = rotation * *target.viewpoint;
  }

  Normalisation normalisation;
  PointCloud source;
  PointCloud target;
};

RefinementSettings pointwise() {
  RefinementSettings settings;
  settings.correspondence = Correspondence::kPoints;
  return settings;
}

/// What a refinement made of a problem.
struct Outcome {
  Outcome(const Problem& problem, const RefinementSettings& settings = {}, int threads = 2)
      : team(threads), refinement(problem.source, settings, selectKernels(), team) {
    refine(problem);
  }

  void refine(const Problem& problem) {
    sighting = refinement.sight(problem.target);
    refined = refinement.refine(
        sighting, {Eigen::Isometry3f::Identity(), Points::Zero(3, problem.source.size())});
    const Points& points = problem.source.points;
    moved =
        refined.pose * (points + refinement.prior()->displacements(points, refined.coefficients));
  }

  Points metres(const Normalisation& normalisation) const {
    return (normalisation.scale * moved).colwise() + normalisation.offset;
  }

  ThreadTeam team;
  Refinement refinement;
  Sighting sighting;
  Refined refined;
  Points moved;  // the network's unit
};

/// RMSE against the truth before and after refinement, of several phantoms.
struct Errors {
  explicit Errors(Protocol protocol) {
    for (const char* organ : kOrgans) {
      for (const std::uint64_t seed : {1, 2, 3, 4}) {
        const RegistrationPair pair = pairOf(organ, protocol, seed);
        const Problem problem(pair);
        const Points moved = Outcome(problem).metres(problem.normalisation);
        const double before = rootMeanSquareDistance(pair.source, pair.truth);
        const double after = rootMeanSquareDistance(moved, pair.truth);
        sum_before += before;
        sum_after += after;
        worst = std::max(worst, after / before);
      }
    }
  }

  double mean() const { return sum_after / sum_before; }

  double worst = 0.0;  ///< error after over that before
  double sum_before = 0.0, sum_after = 0.0;
};

TEST(Refinement, ComesNearerToTheTruthOnWholeSurfaces) {
  const Errors errors(Protocol::kResampled);
  EXPECT_LT(errors.mean(), 0.7);
  EXPECT_LT(errors.worst, 0.95);
}

TEST(Refinement, FindsThePoseOfWholeSurfacesToo) {
  const Errors errors(Protocol::kCaseB);
  EXPECT_LT(errors.mean(), 0.4);
  EXPECT_LT(errors.worst, 0.6);
}

/// Motion along the surface hardly shows on these smooth organs, so single ones may end worse.
TEST(Refinement, ComesNearerToTheTruthInTheMeanOnViewsOfOneSide) {
  const Errors clean(Protocol::kPartial);
  EXPECT_LT(clean.mean(), 0.95);
  EXPECT_LT(clean.worst, 1.5);
  const Errors noisy(Protocol::kIntraop);
  EXPECT_LT(noisy.mean(), 0.9);
  EXPECT_LT(noisy.worst, 1.3);
}

TEST(Refinement, FindsEachPointAmongTheSamePoints) {
  for (const char* organ : kOrgans) {
    const RegistrationPair pair = pairOf(organ, Protocol::kPermuted, 3);
    const Problem problem(pair);
    const double error = rootMeanSquareDistance(
        Outcome(problem, pointwise()).metres(problem.normalisation), pair.truth);
    EXPECT_LT(error, 0.002) << organ;
    EXPECT_GT(rootMeanSquareDistance(pair.source, pair.truth), 0.005) << organ;
  }
}

TEST(Refinement, TellsWholeSurfacesFromViewsOfOneSide) {
  for (const char* organ : kOrgans) {
    EXPECT_TRUE(Outcome(Problem(pairOf(organ, Protocol::kResampled, 1))).sighting.whole) << organ;
    EXPECT_FALSE(Outcome(Problem(pairOf(organ, Protocol::kPartial, 1))).sighting.whole) << organ;
  }
}

TEST(Refinement, FitsBetterFlippedWhereItLiesUpsideDown) {
  for (const char* organ : kOrgans) {
    for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
      Problem problem(pairOf(organ, protocol, 1));
      Outcome found(problem);
      const auto gain = [&](const Eigen::Isometry3f& pose) {
        return found.refinement.flipGain(found.sighting, pose);
      };
      EXPECT_LT(gain(found.refined.pose), 0.0) << organ << ' ' << toString(protocol);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> axes(problem.source.points *
                                                                problem.source.points.transpose());
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Isometry3f flip(
            Eigen::AngleAxisf(static_cast<float>(M_PI), axes.eigenvectors().col(axis)));
        EXPECT_GT(gain(found.refined.pose * flip), 0.0)
            << organ << ' ' << toString(protocol) << " about axis " << axis;
      }
    }
  }
}

TEST(BeyondExpectation, IsNothingOfASmallPoseAndNearlyAllOfALargeOne) {
  const auto pose = [](float turn, float shift) -> Eigen::Isometry3f {
    return Eigen::Translation3f(shift, 0, 0) * Eigen::AngleAxisf(turn, Eigen::Vector3f::UnitY());
  };
  EXPECT_TRUE(beyondExpectation(Eigen::Isometry3f::Identity()).isApprox(pose(0, 0)));
  EXPECT_TRUE(beyondExpectation(pose(0.03F, 0.02F)).isApprox(pose(0, 0)));
  EXPECT_TRUE(beyondExpectation(pose(0.7F, 0)).isApprox(pose(0.63F, 0), 1e-3F));
  EXPECT_TRUE(beyondExpectation(pose(0, 0.35F)).isApprox(pose(0, 0.315F), 1e-3F));
}

TEST(Refinement, RotatesWithBothClouds) {
  for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
    Problem problem(pairOf("liver", protocol, 1));
    const Outcome straight(problem);
    const Eigen::Matrix3f rotation =
        Eigen::AngleAxisf(1.0F, Eigen::Vector3f(1, -2, 3).normalized()).toRotationMatrix();
    problem.rotate(rotation);
    const Outcome turned(problem);
    const double difference = rootMeanSquareDistance(rotation * straight.moved, turned.moved);
    EXPECT_LT(difference, 1e-3) << toString(protocol);
  }
}

TEST(Refinement, DoesNotDependOnTheOrderOfTheTarget) {
  Problem problem(pairOf("liver", Protocol::kPartial, 1));
  const Outcome straight(problem);
  problem.target.points = test::shuffled(problem.target.points, 4);
  const double difference = rootMeanSquareDistance(straight.moved, Outcome(problem).moved);
  EXPECT_LT(difference, 1e-3);
}

TEST(Refinement, HasTheSameBitsForAnyNumberOfThreadsAndAnyHistory) {
  const Problem problem(pairOf("kidney", Protocol::kPartial, 1));
  const Problem other(pairOf("kidney", Protocol::kCaseB, 1));
  const Outcome alone(problem, {}, 1);
  for (const int threads : {1, 2, 3}) {
    Outcome again(problem, {}, threads);
    again.refine(other);
    EXPECT_NE(again.moved, alone.moved);
    again.refine(problem);
    EXPECT_EQ(again.moved, alone.moved);
    EXPECT_EQ(again.refined.covariance_factor, alone.refined.covariance_factor);
  }
}

class RefinementAllocation : public testing::Test {
 protected:
  void SetUp() override { test::requireCounting(); }
};

TEST_F(RefinementAllocation, IsNoneFromANearStartAfterTheFirst) {
  for (const Protocol protocol : {Protocol::kResampled, Protocol::kPartial}) {
    for (const int threads : {1, 2}) {
      const Problem problem(pairOf("liver", protocol, 1));
      Outcome found(problem, {}, threads);
      const SearchStart near{found.refined.pose,
                             found.refinement.prior()->displacements(problem.source.points,
                                                                     found.refined.coefficients),
                             true};
      const auto refine = [&] { found.refinement.refine(found.sighting, near, found.refined); };
      refine();
      EXPECT_EQ(test::countAllocations(refine), 0) << toString(protocol) << ' ' << threads;
    }
  }
}

TEST(Refinement, StaysFiniteOnTargetsThatFixNothing) {
  const RegistrationPair pair = pairOf("liver", Protocol::kResampled, 1);
  Points line = Points::Zero(3, 60);
  line.row(1).setLinSpaced(-0.1F, 0.1F);
  const Points one_point = Eigen::Vector3f(0.02F, 0.01F, 0.0F).replicate(1, 60);
  const Points far = pair.target.array() + 2.0F;
  for (const Points& target : {line, one_point, far, Points(pair.target.leftCols(3))}) {
    RegistrationPair poor = pair;
    poor.target = target;
    const Outcome outcome{Problem(poor)};
    EXPECT_TRUE(outcome.moved.allFinite());
    EXPECT_LT((outcome.moved - Problem(poor).source.points).cwiseAbs().maxCoeff(), 3.0F);
  }
}

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
