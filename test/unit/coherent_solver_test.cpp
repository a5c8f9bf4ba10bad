// SPDX-License-Identifier: BSD-3-Clause
#include "refinement/coherent_solver.hpp"

#include "allocation_counter.hpp"
#include "coherent_reference.hpp"
#include "instruction_set_test.hpp"
#include "oriented_organ.hpp"
#include "refinement/displacement_prior.hpp"

namespace unirit {
namespace {

constexpr Eigen::Index kPoints = 250;
constexpr int kRank = 50;  // several panels of any instruction set, no whole number of tiles
constexpr PosePrior kPrior{0.1F, 0.05F};
constexpr Trust kTrust{0.05F, 0.2F, 0.3F};

Eigen::Isometry3f somePose(float angle = 0.15F) {
  Eigen::Isometry3f pose(Eigen::AngleAxisf(angle, Eigen::Vector3f(1, 2, 3).normalized()));
  pose.translation() << 0.05F, -0.02F, 0.03F;
  return pose;
}

/// An organ whose points are seen, more or less surely, near where they lie.
class CoherentSolving : public InstructionSetTest {
 protected:
  CoherentSolving()
      : organ_(test::orientedOrgan(kPoints, 1)),
        functions_(DisplacementPrior(organ_.points, 0.6, 0.1, kRank).functions(organ_.points)) {
    Random random(3);
    const auto noise = [&] { return static_cast<float>(0.05 * random.normal()); };
    seen_.positions = somePose(0.3F) * organ_.points + Points::NullaryExpr(3, kPoints, noise);
    seen_.normals = somePose(0.3F).linear() * organ_.normals;
    seen_.mass = Eigen::RowVectorXf::NullaryExpr(
        kPoints, [&] { return static_cast<float>(random.uniform(0.0, 1.5)); });
    seen_.mass[7] = 0.0F;
    seen_.normals.col(7).setZero();
  }

  CoherentSolver solver(ThreadTeam& team, const PosePrior& prior = kPrior) const {
    return {organ_.points, functions_, prior, selectKernels(), team};
  }

  CoherentState start(const Eigen::Isometry3f& pose = somePose()) const {
    Eigen::Matrix3Xf coefficients = Eigen::Matrix3Xf::Zero(3, kRank);
    coefficients(0, kRank - 1) = 1.0F;
    return {pose, coefficients, coefficients * functions_};
  }

  reference::Observations observations() const {
    return {organ_.points.cast<double>(),      seen_.positions.cast<double>(),
            seen_.normals.cast<double>(),      seen_.mass.transpose().cast<double>(),
            static_cast<double>(kTrust.along), static_cast<double>(kTrust.across),
            static_cast<double>(kTrust.weight)};
  }

  static reference::State exact(const CoherentState& state) {
    return {state.pose.linear().cast<double>(), state.pose.translation().cast<double>(),
            state.coefficients.cast<double>()};
  }

  /// The dense system of a step from the state.
  reference::NormalEquations equations(const reference::State& state,
                                       const reference::Deviations& deviations) const {
    const Eigen::MatrixXd functions = functions_.cast<double>();
    const Eigen::Matrix3Xd moved = organ_.points.cast<double>() + state.coefficients * functions;
    return reference::normalEquations(observations(), functions, moved, state, deviations);
  }

  static void expectNear(const CoherentState& found, const reference::State& wanted) {
    EXPECT_LT((found.coefficients.cast<double>() - wanted.coefficients).cwiseAbs().maxCoeff(),
              1e-3);
    EXPECT_LT((found.pose.linear().cast<double>() - wanted.rotation).cwiseAbs().maxCoeff(), 1e-5);
    EXPECT_LT((found.pose.translation().cast<double>() - wanted.translation).cwiseAbs().maxCoeff(),
              1e-5);
  }

  const PointCloud organ_;
  const Eigen::MatrixXf functions_;
  Correspondences seen_;
};

const reference::Deviations kPriorDeviations{static_cast<double>(kPrior.rotation),
                                             static_cast<double>(kPrior.translation)};

TEST_P(CoherentSolving, StepsSolveTheDenseLeastSquaresProblem) {
  ThreadTeam team(2);
  CoherentSolver fast = solver(team);
  CoherentState state = start();
  reference::State wanted = exact(state);
  reference::Deviations deviations = kPriorDeviations;
  for (int step = 0; step < 3; ++step) {
    SCOPED_TRACE(step);
    const reference::NormalEquations dense = equations(wanted, deviations);
    reference::solve(dense, wanted);
    deviations = reference::learnt(dense, wanted, kPrior);
    fast.solve(seen_, kTrust, state);
    expectNear(state, wanted);
    EXPECT_LT((state.displacements - state.coefficients * functions_).cwiseAbs().maxCoeff(), 1e-6F);
  }
  EXPECT_GT(deviations.rotation, 1.2 * kPriorDeviations.rotation);  // 0.3 radian were to be found
}

TEST_P(CoherentSolving, AStrideGoesSoManyTimesAsFar) {
  ThreadTeam team(1);
  CoherentState once = start(), farther = start();
  const CoherentState before = start();
  solver(team).solve(seen_, kTrust, once);
  solver(team).solve(seen_, kTrust, farther, 1.8F);
  EXPECT_TRUE((farther.coefficients - before.coefficients)
                  .isApprox(1.8F * (once.coefficients - before.coefficients), 1e-4F));
  EXPECT_TRUE(farther.displacements.isApprox(farther.coefficients * functions_, 1e-5F));
  const Eigen::Isometry3f step = before.pose.inverse() * once.pose;
  const Eigen::Isometry3f stride = before.pose.inverse() * farther.pose;
  EXPECT_TRUE(stride.translation().isApprox(1.8F * step.translation(), 1e-3F));
  EXPECT_NEAR(Eigen::AngleAxisf(stride.linear()).angle(),
              1.8F * Eigen::AngleAxisf(step.linear()).angle(), 1e-3F);
}

TEST_P(CoherentSolving, CovarianceIsThatOfTheDenseProblem) {
  ThreadTeam team(2);
  CoherentSolver fast = solver(team);
  CoherentState state = start();
  const Eigen::MatrixXd covariance = equations(exact(state), kPriorDeviations).covariance();
  fast.solve(seen_, kTrust, state);
  Eigen::MatrixXf in_single;
  fast.covarianceFactor(in_single);
  const Eigen::MatrixXd factor = in_single.cast<double>();
  ASSERT_EQ(factor.rows(), 3 * kRank + 6);
  ASSERT_EQ(factor.cols(), 3 * kRank);
  const Eigen::MatrixXd found = factor.transpose() * factor;
  const Eigen::MatrixXd expected = covariance.topLeftCorner(3 * kRank, 3 * kRank);
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT(expected.diagonal().minCoeff(), 0.2);  // something was learnt,
  EXPECT_LE(expected.diagonal().maxCoeff(), 1.0);  // from a prior of standard normals
}

TEST_P(CoherentSolving, UnseenOrgansAreLeftToThePrior) {
  ThreadTeam team(1);
  CoherentSolver fast = solver(team);
  CoherentState state = start();
  seen_.mass.setZero();
  for (int step = 0; step < 5; ++step) fast.solve(seen_, kTrust, state);
  EXPECT_LT(state.coefficients.cwiseAbs().maxCoeff(), 1e-5F);
  EXPECT_TRUE(state.pose.isApprox(Eigen::Isometry3f::Identity(), 1e-4F));
  Eigen::MatrixXf factor;
  fast.covarianceFactor(factor);
  EXPECT_TRUE((factor.transpose() * factor).isIdentity(1e-4F));
}

TEST_P(CoherentSolving, PoseAloneIsFoundWhereTheMotionIsRigid) {
  ThreadTeam team(1);
  CoherentSolver fast = solver(team, {10.0F, 10.0F});
  CoherentState state = start(Eigen::Isometry3f::Identity());
  state.displacements.setZero();
  seen_.positions = somePose(0.8F) * organ_.points;
  seen_.normals = somePose(0.8F).linear() * organ_.normals;
  for (int step = 0; step < 10; ++step) fast.solvePose(seen_, {0.05F, 0.05F, 1.0F}, state);
  EXPECT_LT((state.pose.matrix() - somePose(0.8F).matrix()).cwiseAbs().maxCoeff(), 1e-4F);
  EXPECT_EQ(state.displacements, Points::Zero(3, kPoints));
}

TEST_P(CoherentSolving, PoseAloneTakesTheDisplacementsAsTheyAre) {
  ThreadTeam team(1);
  CoherentSolver fast = solver(team, {10.0F, 10.0F});
  CoherentState state = start(Eigen::Isometry3f::Identity());
  seen_.positions = somePose() * (organ_.points + state.displacements);
  const Points before = state.displacements;
  for (int step = 0; step < 10; ++step) fast.solvePose(seen_, kTrust, state);
  EXPECT_LT((state.pose.matrix() - somePose().matrix()).cwiseAbs().maxCoeff(), 1e-4F);
  EXPECT_EQ(state.displacements, before);
}

TEST_P(CoherentSolving, PosePriorPullsToTheStart) {
  ThreadTeam team(1);
  const auto found = [&](float deviation) {
    CoherentSolver fast = solver(team, {deviation, deviation});
    CoherentState state = start(Eigen::Isometry3f::Identity());
    for (int step = 0; step < 5; ++step) fast.solvePose(seen_, kTrust, state);
    return state.pose;
  };
  const auto angle = [&](float deviation) {
    return Eigen::AngleAxisf(found(deviation).linear()).angle();
  };
  EXPECT_NEAR(angle(10.0F), 0.3F, 0.03F);
  EXPECT_LT(angle(0.01F), 0.8F * angle(10.0F));
  EXPECT_LT(angle(0.0001F), 0.001F);
  EXPECT_LT(found(0.0001F).translation().norm(), 0.001F);
}

TEST_P(CoherentSolving, RestartForgetsAndThreadsDoNotMatter) {
  CoherentState first;
  for (const int threads : {1, 2, 3}) {
    ThreadTeam team(threads);
    CoherentSolver fast = solver(team);
    for (int run = 0; run < 2; ++run) {
      CoherentState state = start();
      fast.solve(seen_, kTrust, state);
      if (first.displacements.cols() == 0) first = state;
      EXPECT_EQ(state.pose.matrix(), first.pose.matrix());
      EXPECT_EQ(state.coefficients, first.coefficients);
      fast.restart(kPrior);
    }
    CoherentState again = start();
    fast.solve(seen_, kTrust, again);
    again = start();
    fast.solve(seen_, kTrust, again);  // without a restart: the deviations are learnt ones
    EXPECT_NE(again.coefficients, first.coefficients);
  }
}

class CoherentSolvingAllocation : public CoherentSolving {
 protected:
  void SetUp() override {
    CoherentSolving::SetUp();
    test::requireCounting();
  }
};

TEST_P(CoherentSolvingAllocation, StepsAllocateNothingAfterTheFirst) {
  for (const int threads : {1, 2}) {
    ThreadTeam team(threads);
    CoherentSolver fast = solver(team);
    CoherentState state = start();
    const auto step = [&] {
      fast.solvePose(seen_, kTrust, state);
      fast.solve(seen_, kTrust, state);
    };
    EXPECT_GT(test::countAllocations(step), 0) << "the first step sizes the buffers";
    EXPECT_EQ(test::countAllocations(step), 0) << threads << " threads";
  }
}

UNIRIT_ON_EVERY_INSTRUCTION_SET(CoherentSolving);
UNIRIT_ON_EVERY_INSTRUCTION_SET(CoherentSolvingAllocation);

}  // namespace
}  // namespace unirit
