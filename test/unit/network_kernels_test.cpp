// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "instruction_set_test.hpp"
#include "network/dense_layer.hpp"
#include "network_inputs.hpp"

namespace unirit {
namespace {

using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class Kernel : public InstructionSetTest {
 protected:
  static Layer randomLayer(int inputs, int outputs) {
    Random random(3);
    const auto normal = [&] { return static_cast<float>(random.normal()); };
    return {Eigen::MatrixXf::NullaryExpr(outputs, inputs, normal),
            Eigen::VectorXf::NullaryExpr(outputs, normal)};
  }

  static RowMajor randomRows(int rows, int columns) {
    Random random(4);
    return RowMajor::NullaryExpr(rows, columns,
                                 [&] { return static_cast<float>(random.normal()); });
  }

  static RowMajor apply(const DenseLayer& layer, const RowMajor& input) {
    RowMajor output = RowMajor::Zero(input.rows(), static_cast<long>(layer.paddedOutputs()));
    selectKernels().dense(layer.view(), {input.data(), input.cols(), input.rows()}, 0,
                          layer.view().panel_count, output.data(), output.cols());
    return output;
  }
};

TEST_P(Kernel, denseIsWeightTimesInputPlusBias) {
  for (const auto& [inputs, outputs] : {std::pair{3, 64}, {70, 7}, {129, 33}}) {
    const Layer layer = randomLayer(inputs, outputs);
    const DenseLayer packed(selectKernels(), layer, Activation::kNone);
    for (const int rows : {1, 2, 5, 11, 12, 13, 48}) {
      const RowMajor input = randomRows(rows, inputs);
      const RowMajor expected =
          (input * layer.weight.transpose()).rowwise() + layer.bias.transpose();
      EXPECT_LT((apply(packed, input).leftCols(outputs) - expected).cwiseAbs().maxCoeff(), 2e-5F)
          << inputs << " inputs, " << outputs << " outputs, " << rows << " rows";
    }
  }
}

TEST_P(Kernel, neighbourhoodSumsWeighByEverSmallerGaussians) {
  const Points points = test::randomPoints(35, 1), queries = test::randomPoints(18, 2);
  const RowMajor values = randomRows(35, kAveraged);
  const long asked = 17;
  RowMajor sums = RowMajor::Constant(18, kNeighbourhoods * kAveraged, -1.0F);
  selectKernels().neighbourhoodSums(queries.data(), asked, points.data(), values.data(), 35, -0.7F,
                                    sums.data());
  for (long q = 0; q < asked; ++q) {
    double exponent = -0.7;
    for (int size = 0; size < kNeighbourhoods; ++size, exponent *= 4.0) {
      const auto distances = (points.colwise() - queries.col(q)).colwise().squaredNorm();
      const Eigen::VectorXd weights =
          (exponent * distances.transpose().cast<double>().array()).exp();
      const Eigen::RowVectorXd expected = weights.transpose() * values.cast<double>();
      EXPECT_LT((sums.row(q).segment(kAveraged * size, kAveraged).cast<double>() - expected)
                    .cwiseAbs()
                    .maxCoeff(),
                5e-5);
    }
  }
  EXPECT_EQ(sums.row(asked).maxCoeff(), -1.0F) << "one not asked for";
}

TEST_P(Kernel, reluCutsWhatIsNegativeAndNothingElse) {
  const Layer layer = randomLayer(20, 33);
  const RowMajor input = randomRows(13, 20);
  const RowMajor open = apply(DenseLayer(selectKernels(), layer, Activation::kNone), input);
  const RowMajor cut = apply(DenseLayer(selectKernels(), layer, Activation::kRelu), input);
  EXPECT_LT(open.minCoeff(), 0.0F);
  EXPECT_EQ(cut, RowMajor(open.cwiseMax(0.0F)));
}

TEST_P(Kernel, aRowHasTheSameBitsInAnyBlock) {
  const DenseLayer layer(selectKernels(), randomLayer(257, 40), Activation::kNone);
  const RowMajor input = randomRows(48, 257);
  const RowMajor together = apply(layer, input);
  for (int first = 0; first < 48; first += 7) {
    for (const int rows : {1, 3, 8}) {
      const int count = std::min(rows, 48 - first);
      EXPECT_EQ(apply(layer, input.middleRows(first, count)), together.middleRows(first, count));
    }
  }
}

TEST_P(Kernel, maximumIsTheLargestOutputOverTheRows) {
  const DenseLayer layer(selectKernels(), randomLayer(20, 64), Activation::kRelu);
  const RowMajor input = randomRows(31, 20);
  Eigen::RowVectorXf maxima = Eigen::RowVectorXf::Zero(64);
  selectKernels().denseMaximum(layer.view(), {input.data(), 20, 17}, maxima.data());
  selectKernels().denseMaximum(layer.view(), {input.data() + 17 * 20, 20, 14}, maxima.data());
  EXPECT_EQ(maxima, Eigen::RowVectorXf(apply(layer, input).colwise().maxCoeff()));
}

TEST_P(Kernel, nearestIsExactAndTheFirstAmongEquals) {
  Points targets = test::randomPoints(67, 5);
  targets.col(40) = targets.col(7);
  Points queries = test::randomPoints(53, 6);
  queries.col(52) = targets.col(40);
  std::vector<int> indices(53, -1);
  selectKernels().nearest(queries.data(), 53, targets.data(), 67, indices.data());
  EXPECT_EQ(indices.back(), 7);
  for (Eigen::Index i = 0; i < 53; ++i) {
    const auto distances = (targets.colwise() - queries.col(i)).colwise().squaredNorm();
    const int found = indices[static_cast<std::size_t>(i)];
    ASSERT_GE(found, 0);
    EXPECT_LE(distances(found), distances.minCoeff() * (1.0F + 1e-6F)) << "query " << i;
  }
}

UNIRIT_ON_EVERY_INSTRUCTION_SET(Kernel);

}  // namespace
}  // namespace unirit
