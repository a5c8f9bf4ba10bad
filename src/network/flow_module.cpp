// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "encoder.hpp"
#include "modules.hpp"
#include "point_decoder.hpp"
#include "surroundings.hpp"

namespace unirit {
namespace {

/// So many evenly chosen points, all where they are fewer, in the order of their coordinates, so
/// that none given to them counts.
void orderPoints(const Points& points, std::size_t at_most, std::vector<int>& order) {
  order.resize(static_cast<std::size_t>(points.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const float *p = points.col(a).data(), *q = points.col(b).data();
    return std::lexicographical_compare(p, p + 3, q, q + 3);
  });
  const std::size_t kept = std::min(order.size(), at_most);
  for (std::size_t i = 0; i < kept; ++i) order[i] = order[i * order.size() / kept];
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
RigidStep bestRigidFit(const Points& points, const Points& reached) {
  const auto count = static_cast<double>(points.cols());
  Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    from += points.col(i).cast<double>() / count;
    to += reached.col(i).cast<double>() / count;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d moved = reached.col(i).cast<double>() - to;
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

/// What the best rigid fit leaves of the way from `start` to `reached`.
void deformationInto(const RigidStep& fit, const Points& start, const Points& reached,
                     Points& deformation) {
  const Eigen::Matrix3f rotation = fit.rotation.toRotationMatrix();
  deformation.resize(3, start.cols());
  for (Eigen::Index i = 0; i < start.cols(); ++i) {
    deformation.col(i) = reached.col(i) - rotation * start.col(i) - fit.translation;
  }
}

/// Buffers for clouds of one size.
struct FlowStage {
  explicit FlowStage(Workspace& workspace) : surroundings(workspace) {}

  /// Reads at most so many points of each cloud.
  void setClouds(const Points& source, const Points& to,
                 std::size_t at_most = std::numeric_limits<std::size_t>::max()) {
    orderPoints(source, at_most, order);
    orderPoints(to, at_most, target_order);
    selectInto(to, target_order, target);
    surroundings.setTarget(target);
    begin(source);
  }

  /// The source, in the order that is set, stands here and is not deformed.
  void begin(const Points& source) {
    selectInto(source, order, start);
    reached = start;
  }

  std::vector<int> order, target_order;
  Points start, reached, deformation, target, flow;  // of the source but for target
  RigidStep fit;                                     // from start to reached
  Surroundings surroundings;
  std::vector<float> rows;  // read of the source
  Eigen::VectorXf features = Eigen::VectorXf::Zero(2 * kFlowFeatureSize);
};

class FlowModule : public Modules {
 public:
  FlowModule(const Weights& weights, Workspace& workspace)
      : workspace_(workspace), weights_(weights) {}

  RigidStep rigidStep(const Points& moved, const Points& target, bool first, bool fine) override {
    if (fine) {
      fine_.setClouds(moved, target);
      return followed(fine_, kFlowFineSteps);
    }
    if (first) {
      coarse_.setClouds(moved, target, kFlowCoarsePoints);
    } else {
      coarse_.begin(moved);
    }
    return followed(coarse_, kFlowCoarseSteps);
  }

  void displace(const Points& source, const Points& target, const Points& queries,
                Points& displacements) override {
    const bool of_source = queries.cols() == source.cols() && queries == source;
    nonrigid_.setClouds(source, target);
    reached_ = queries;
    for (int step = 0; step < kFlowNonRigidSteps; ++step) {
      const RowsView rows = encode(nonrigid_);
      if (!of_source) {
        deformationInto(nonrigid_.fit, queries, reached_, query_deformation_);
        decode(nonrigid_, nonrigid_.surroundings.of(reached_, query_deformation_, query_rows_),
               query_flow_);
        reached_ += query_flow_;
      }
      if (!of_source && step + 1 == kFlowNonRigidSteps) break;  // no one asks where the source ends
      decode(nonrigid_, rows, nonrigid_.flow);
      nonrigid_.reached += nonrigid_.flow;
    }
    if (!of_source) {
      displacements = reached_ - queries;
      return;
    }
    for (std::size_t i = 0; i < nonrigid_.order.size(); ++i) {
      const auto sorted = static_cast<Eigen::Index>(i);
      const int given = nonrigid_.order[i];
      displacements.col(given) = nonrigid_.reached.col(sorted) - source.col(given);
    }
  }

  const Eigen::VectorXf& rigidFeatures() const override { return fine_.features; }
  const Eigen::VectorXf& nonRigidFeatures() const override { return nonrigid_.features; }

 private:
  /// The best rigid fit of so many steps along the flow.
  RigidStep followed(FlowStage& stage, int steps) {
    for (int i = 0; i < steps; ++i) {
      decode(stage, encode(stage), stage.flow);
      stage.reached += stage.flow;
    }
    RigidStep step = bestRigidFit(stage.start, stage.reached);
    step.converged = motion(step, stage.start) < kFlowConverged;
    return step;
  }

  /// Of points, RMS.
  static float motion(const RigidStep& step, const Points& points) {
    const Eigen::Matrix3f turn = step.rotation.toRotationMatrix() - Eigen::Matrix3f::Identity();
    float sum = 0.0F;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      sum += (turn * points.col(i) + step.translation).squaredNorm();
    }
    return std::sqrt(sum / static_cast<float>(points.cols()));
  }

  /// Features of both clouds; returns what is read of the source.
  RowsView encode(FlowStage& stage) {
    stage.fit = bestRigidFit(stage.start, stage.reached);
    deformationInto(stage.fit, stage.start, stage.reached, stage.deformation);
    stage.surroundings.setSource(stage.reached, stage.deformation);
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
                rows.data + (begin + i) * rows.stride + kFlowFirstVector);
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
  FlowStage coarse_{workspace_}, fine_{workspace_}, nonrigid_{workspace_};
  Points reached_, query_deformation_, query_flow_;
  std::vector<float> query_rows_;
};

}  // namespace

std::unique_ptr<Modules> makeFlowModule(const Weights& weights, Workspace& workspace) {
  return std::make_unique<FlowModule>(weights, workspace);
}

}  // namespace unirit
