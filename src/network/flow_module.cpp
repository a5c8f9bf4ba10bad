// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "encoder.hpp"
#include "modules.hpp"
#include "point_decoder.hpp"
#include "surroundings.hpp"

namespace unirit {
namespace {

/// The order of the points' coordinates, so that none given to them counts; of more than `most`,
/// evenly chosen ones.
void orderPoints(const Points& points, Eigen::Index most, std::vector<int>& order) {
  order.resize(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const float *p = points.col(a).data(), *q = points.col(b).data();
    return std::lexicographical_compare(p, p + 3, q, q + 3);
  });
  const auto stride = static_cast<std::size_t>((points.cols() + most - 1) / most);
  const std::size_t kept = (order.size() + stride - 1) / stride;
  for (std::size_t i = 0; i < kept; ++i) order[i] = order[i * stride];
  order.resize(kept);
}

/// Allocates nothing where the number stays.
void selectInto(const Points& points, const std::vector<int>& order, Points& selected) {
  selected.resize(3, static_cast<Eigen::Index>(order.size()));
  for (std::size_t i = 0; i < order.size(); ++i) {
    selected.col(static_cast<Eigen::Index>(i)) = points.col(order[i]);
  }
}

/// The rigid transform that takes points nearest to their displaced ones (Umeyama 1991).
RigidStep bestRigidFit(const Points& points, const Points& displacements) {
  const auto count = static_cast<double>(points.cols());
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    from += points.col(i).cast<double>() / count;
    to += (points.col(i) + displacements.col(i)).cast<double>() / count;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d moved = (points.col(i) + displacements.col(i)).cast<double>() - to;
    covariance += moved * (points.col(i).cast<double>() - from).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0) u.col(2) = -u.col(2);
  const Eigen::Matrix3d rotation = u * svd.matrixV().transpose();
  return {Eigen::Quaterniond(rotation).normalized().cast<float>(),
          (to - rotation * from).cast<float>()};
}

/// Buffers of a stage, whose clouds may be of other sizes than the other stage's.
struct FlowStage {
  explicit FlowStage(Workspace& workspace) : surroundings(workspace) {}

  /// The points in the order of their coordinates, at most so many of each cloud.
  void setOrder(const Points& from, const Points& to, Eigen::Index most_from,
                Eigen::Index most_to) {
    orderPoints(from, most_from, order);
    orderPoints(to, most_to, target_order);
    selectInto(to, target_order, target);
  }

  std::vector<int> order, target_order;
  Points source, target, flow;
  Surroundings surroundings;
  std::vector<float> rows;  // read of the source
  Eigen::VectorXf features = Eigen::VectorXf::Zero(2 * kFlowFeatureSize);
};

class FlowModule : public Modules {
 public:
  FlowModule(const Weights& weights, Workspace& workspace)
      : workspace_(workspace), weights_(weights) {}

  RigidStep rigidStep(const Points& moved, const Points& target, bool first) override {
    if (first) rigid_.setOrder(moved, target, kFlowRigidPoints, kFlowRigidPoints);
    selectInto(moved, rigid_.order, rigid_.source);
    decode(rigid_, encode(rigid_), rigid_.flow);
    RigidStep step = bestRigidFit(rigid_.source, rigid_.flow);
    step.last = motion(step) < kFlowConverged;
    return step;
  }

  void displace(const Points& source, const Points& target, const Points& queries,
                Points& displacements) override {
    const bool of_source = queries.cols() == source.cols() && queries == source;
    nonrigid_.setOrder(source, target, source.cols(), target.cols());
    selectInto(source, nonrigid_.order, nonrigid_.source);
    reached_ = queries;
    for (int step = 0; step < kFlowSteps; ++step) {
      const RowsView rows = encode(nonrigid_);
      if (!of_source) {
        decode(nonrigid_, nonrigid_.surroundings.of(reached_, query_rows_), query_flow_);
        reached_ += query_flow_;
      }
      if (!of_source && step + 1 == kFlowSteps) break;  // no one asks where the source ends
      decode(nonrigid_, rows, nonrigid_.flow);
      nonrigid_.source += nonrigid_.flow;
    }
    if (!of_source) {
      displacements = reached_ - queries;
      return;
    }
    for (std::size_t i = 0; i < nonrigid_.order.size(); ++i) {
      const auto sorted = static_cast<Eigen::Index>(i);
      const int given = nonrigid_.order[i];
      displacements.col(given) = nonrigid_.source.col(sorted) - source.col(given);
    }
  }

  const Eigen::VectorXf& rigidFeatures() const override { return rigid_.features; }
  const Eigen::VectorXf& nonRigidFeatures() const override { return nonrigid_.features; }

 private:
  /// Of the source's points, RMS.
  float motion(const RigidStep& step) const {
    const Points& points = rigid_.source;
    const Eigen::Matrix3f turn = step.rotation.toRotationMatrix() - Eigen::Matrix3f::Identity();
    float sum = 0.0F;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      sum += (turn * points.col(i) + step.translation).squaredNorm();
    }
    return std::sqrt(sum / static_cast<float>(points.cols()));
  }

  /// Features of both clouds; returns what is read of the source.
  RowsView encode(FlowStage& stage) {
    stage.surroundings.setClouds(stage.source, stage.target);
    const RowsView rows = stage.surroundings.ofSource(stage.rows);
    source_encoder_.encode(rows, stage.features.data(), workspace_);
    target_encoder_.encode(stage.surroundings.ofTarget(), stage.features.data() + kFlowFeatureSize,
                           workspace_);
    return rows;
  }

  void decode(const FlowStage& stage, const RowsView& rows, Points& flow) {
    flow.resize(3, rows.count);
    decoder_.decode(
        stage.features.data(), rows.count, workspace_,
        [&](Scratch&, long begin, long count) {
          return RowsView{rows.data + begin * rows.stride, rows.stride, count};
        },
        [&](long begin, const RowsView& outputs) {
          for (long i = 0; i < outputs.count; ++i) {
            const Eigen::Map<const Eigen::Matrix<float, 3 + kFlowVectors, 1>> output(
                outputs.data + i * outputs.stride);
            const Eigen::Map<const Eigen::Matrix<float, 3, kFlowVectors>> vectors(
                rows.data + (begin + i) * rows.stride + kFlowInputs - 4 * kFlowVectors);
            flow.col(begin + i) = output.head<3>() + vectors * output.tail<kFlowVectors>();
          }
        });
    if (!flow.allFinite()) throw std::runtime_error("the flow module's output is not finite");
  }

  Workspace& workspace_;
  const Weights& weights_;
  const Kernels& kernels_ = workspace_.kernels();
  Encoder source_encoder_{kernels_, weights_, "flow.source_encoder"};
  Encoder target_encoder_{kernels_, weights_, "flow.target_encoder"};
  PointDecoder decoder_{kernels_,       weights_,
                        "flow.decoder", static_cast<int>(kFlowDecoderWidths.size()),
                        kFlowInputs,    2 * kFlowFeatureSize};
  FlowStage rigid_{workspace_}, nonrigid_{workspace_};
  Points reached_, query_flow_;
  std::vector<float> query_rows_;
};

}  // namespace

std::unique_ptr<Modules> makeFlowModule(const Weights& weights, Workspace& workspace) {
  return std::make_unique<FlowModule>(weights, workspace);
}

}  // namespace unirit
