// SPDX-License-Identifier: BSD-3-Clause
#include "network/cholesky_factor.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "instruction_set_test.hpp"
#include "unirit/random.hpp"

namespace unirit {
namespace {

class CholeskyFactorTest : public InstructionSetTest {
 protected:
  static Eigen::MatrixXf positiveDefinite(Eigen::Index size) {
    Random random(7);
    const Eigen::MatrixXf root = Eigen::MatrixXf::NullaryExpr(
        size, size + 1, [&] { return static_cast<float>(random.normal()); });
    return Eigen::MatrixXf::Identity(size, size) + root * root.transpose();
  }

  CholeskyFactor factor_{selectKernels()};
};

TEST_P(CholeskyFactorTest, isThatOfDoublePrecisionForAnySize) {
  for (const Eigen::Index size : {1, 3, 4, 17, 32, 63, 150, 5}) {  // smaller ones after larger
    const Eigen::MatrixXf matrix = positiveDefinite(size);
    ASSERT_TRUE(factor_.compute(matrix)) << size;
    const Eigen::MatrixXd expected = matrix.cast<double>().llt().matrixL();
    const Eigen::MatrixXf found = factor_.matrixL().triangularView<Eigen::Lower>();
    EXPECT_LT((found.cast<double>() - expected).norm(), 1e-5 * expected.norm()) << size;
  }
}

TEST_P(CholeskyFactorTest, solvesWithTheLowerHalfAlone) {
  Eigen::MatrixXf matrix = positiveDefinite(37);
  const Eigen::VectorXf expected = Eigen::VectorXf::LinSpaced(37, -1.0F, 1.0F);
  Eigen::VectorXf found = matrix * expected;
  matrix.triangularView<Eigen::StrictlyUpper>().setConstant(
      std::numeric_limits<float>::quiet_NaN());
  ASSERT_TRUE(factor_.compute(matrix));
  factor_.solveInPlace(found);
  EXPECT_LT((found - expected).norm(), 1e-3F * expected.norm());
}

TEST_P(CholeskyFactorTest, saysWhereThereIsNone) {
  Eigen::MatrixXf matrix = positiveDefinite(37);
  for (const Eigen::Index pivot : {0, 20, 36}) {
    Eigen::MatrixXf indefinite = matrix;
    indefinite(pivot, pivot) = -1.0F;
    EXPECT_FALSE(factor_.compute(indefinite)) << pivot;
    Eigen::VectorXf solution = Eigen::VectorXf::Ones(37);
    factor_.solveInPlace(solution);
    EXPECT_FALSE(solution.allFinite()) << pivot;
    indefinite(pivot, pivot) = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(factor_.compute(indefinite)) << pivot;
  }
  EXPECT_FALSE(factor_.compute(Eigen::MatrixXf::Zero(6, 6)));
  matrix(30, 2) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(factor_.compute(matrix));
  EXPECT_TRUE(factor_.compute(positiveDefinite(37))) << "after one that had none";
}

UNIRIT_ON_EVERY_INSTRUCTION_SET(CholeskyFactorTest);

}  // namespace
}  // namespace unirit
