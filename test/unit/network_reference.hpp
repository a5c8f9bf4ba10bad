// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "flow_reference.hpp"

/// The network as network.hpp describes it, layer by layer in double precision and without any
/// saving: what the fast one is held against.
namespace unirit::reference {

/// The accumulated transform after each iteration.
inline std::vector<Eigen::Isometry3d> estimateRigid(const Weights& weights,
                                                    const Points& source_points,
                                                    const Points& target_points, int iterations) {
  const bool by_flow = weights.pairing == Pairing::kOffsets;
  std::vector<Eigen::Isometry3d> iterates;
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  for (int left = iterations; left > 0;) {
    const bool coarse = by_flow && left > 1;
    const auto read = [&](const Points& points) -> Eigen::Matrix3Xd {
      if (!by_flow) return points.cast<double>();
      return evenly(points, coarse ? kFlowCoarsePoints : points.cols()).cast<double>();
    };
    const Eigen::Matrix3Xd source = read(source_points), target = read(target_points);
    const Eigen::Matrix3Xd moved = transform * source;
    Eigen::Isometry3d step;
    if (by_flow) {
      MovingCloud cloud(moved), none(Eigen::Matrix3Xd(3, 0));
      followFlow(weights, coarse ? kFlowCoarseSteps : kFlowFineSteps, cloud, target, none);
      step = Eigen::umeyama(cloud.start, cloud.reached, false);
    } else {
      const Eigen::VectorXd pose =
          decode(weights, "rigid.decoder", features(weights, "rigid", moved, target));
      const Eigen::Quaterniond rotation(pose[0], pose[1], pose[2], pose[3]);
      step = Eigen::Translation3d(pose.tail<3>()) * rotation.normalized();
    }
    transform = step * transform;
    iterates.push_back(transform);
    const double motion = (step * moved - moved).norm() / std::sqrt(moved.cols());
    const bool converged = by_flow && motion < static_cast<double>(kFlowConverged);
    left = converged ? std::min(left - 1, 1) : left - 1;
  }
  return iterates;
}

inline Eigen::Matrix3Xd estimateDisplacements(const Weights& weights, const Points& source_points,
                                              const Points& target_points,
                                              const Points& query_points) {
  const Eigen::Matrix3Xd source = source_points.cast<double>();
  const Eigen::Matrix3Xd queries = query_points.cast<double>();
  const Eigen::Matrix3Xd target = target_points.cast<double>();
  if (weights.pairing == Pairing::kOffsets) {
    MovingCloud cloud(source), moving_queries(queries);
    const Points sorted = evenly(target_points, target_points.cols());
    followFlow(weights, kFlowNonRigidSteps, cloud, sorted.cast<double>(), moving_queries);
    return moving_queries.reached - queries;
  }
  const Eigen::VectorXd both = features(weights, "nonrigid", source, target);
  Eigen::MatrixXd inputs(nonRigidDecoderInputs(weights.pairing), queries.cols());
  inputs.topRows(3) = queries;
  inputs.middleRows(3, both.size()).colwise() = both;
  if (weights.pairing == Pairing::kRow) inputs.bottomRows(3) = target;
  if (weights.pairing == Pairing::kNearest) inputs.bottomRows(3) = offsets(queries, target);
  return decode(weights, "nonrigid.decoder", inputs);
}

}  // namespace unirit::reference
