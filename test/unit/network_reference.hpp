// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "unirit/network/network.hpp"
#include "unirit/random.hpp"

/// The network as network.hpp describes it, layer by layer in double precision and without any
/// saving: what the fast one is held against.
namespace unirit::reference {

inline Eigen::MatrixXd dense(const Weights& weights, const std::string& name,
                             const Eigen::MatrixXd& input, bool relu) {
  const Layer& layer = weights.layers.at(name);
  Eigen::MatrixXd output =
      (layer.weight.cast<double>() * input).colwise() + layer.bias.cast<double>();
  return relu ? Eigen::MatrixXd(output.cwiseMax(0.0)) : output;
}

inline Eigen::MatrixXd decode(const Weights& weights, const std::string& name,
                              Eigen::MatrixXd values) {
  const auto layer = [&](int i) { return name + "." + std::to_string(i); };
  for (int i = 0; weights.layers.count(layer(i)) > 0; ++i) {
    values = dense(weights, layer(i), values, weights.layers.count(layer(i + 1)) > 0);
  }
  return values;
}

inline Eigen::Index nearest(const Eigen::Vector3d& point, const Eigen::Matrix3Xd& others) {
  Eigen::Index nearest = 0;
  (others.colwise() - point).colwise().squaredNorm().minCoeff(&nearest);
  return nearest;
}

/// From each point to the nearest of the others.
inline Eigen::Matrix3Xd offsets(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& others) {
  Eigen::Matrix3Xd offsets(3, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    offsets.col(i) = others.col(nearest(points.col(i), others)) - points.col(i);
  }
  return offsets;
}

/// Of a column of numbers for each point.
inline Eigen::VectorXd encode(const Weights& weights, const std::string& name,
                              Eigen::MatrixXd values) {
  for (int i = 0; i < 5; ++i) {
    values = dense(weights, name + "." + std::to_string(i), values, true);
  }
  return values.rowwise().maxCoeff();
}

inline Eigen::VectorXd features(const Weights& weights, const std::string& module,
                                const Eigen::MatrixXd& source, const Eigen::MatrixXd& target) {
  const auto of_source = encode(weights, module + ".source_encoder", source),
             of_target = encode(weights, module + ".target_encoder", target);
  Eigen::VectorXd both(of_source.size() + of_target.size());
  both << of_source, of_target;
  return both;
}

/// A cloud of the source's frame on its way along the flow.
struct MovingCloud {
  explicit MovingCloud(const Eigen::Matrix3Xd& points) : start(points), reached(points) {}

  /// What the best rigid fit of the source leaves of its way.
  Eigen::Matrix3Xd deformation(const MovingCloud& source) const {
    const Eigen::Isometry3d fit(Eigen::umeyama(source.start, source.reached, false));
    return reached - fit * start;
  }

  Eigen::Matrix3Xd start, reached;
};

/// The directions in which the points about each vary least.
inline Eigen::Matrix3Xd normals(const Eigen::Matrix3Xd& points) {
  Eigen::Matrix3Xd normals(3, points.cols());
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    const Eigen::RowVectorXd weights =
        (-0.5 / std::pow(kFlowScales.back(), 2) *
         (points.colwise() - points.col(j)).colwise().squaredNorm().array())
            .exp();
    const Eigen::Vector3d mean = points * weights.transpose() / weights.sum();
    const Eigen::Matrix3Xd rest = points.colwise() - mean;
    const Eigen::Matrix3d covariance = rest * weights.asDiagonal() * rest.transpose();
    normals.col(j) =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvectors().col(0);
  }
  return normals;
}

/// What the flow module reads of each of `queries`, among the source's points.
inline Eigen::MatrixXd surroundings(const MovingCloud& moving_source,
                                    const Eigen::Matrix3Xd& target,
                                    const MovingCloud& moving_queries) {
  const Eigen::Matrix3Xd &source = moving_source.reached, &queries = moving_queries.reached;
  const Eigen::Matrix3Xd deformation = moving_source.deformation(moving_source);
  const Eigen::Matrix3Xd of_queries = moving_queries.deformation(moving_source);
  const Eigen::Matrix3Xd to_target = offsets(source, target), to_source = offsets(target, source);
  const Eigen::Matrix3Xd target_normals = normals(target);
  Eigen::Matrix3Xd source_normals(3, source.cols());
  for (Eigen::Index i = 0; i < source.cols(); ++i) {
    source_normals.col(i) = target_normals.col(nearest(source.col(i), target));
  }
  const double ratio = static_cast<double>(source.cols()) / static_cast<double>(target.cols());
  Eigen::MatrixXd inputs(kFlowInputs, queries.cols());
  for (Eigen::Index q = 0; q < queries.cols(); ++q) {
    const Eigen::Vector3d query = queries.col(q);
    std::vector<Eigen::Vector3d> vectors{offsets(query, target), of_queries.col(q)};
    std::vector<double> shares;
    for (const double scale : kFlowScales) {
      const auto weightAt = [&](const Eigen::Vector3d& point) {
        return std::exp(-0.5 * (point - query).squaredNorm() / (scale * scale));
      };
      Eigen::Vector3d forth = Eigen::Vector3d::Zero(), back = forth, deformed = forth;
      Eigen::Vector3d to_plane = Eigen::Vector3d::Zero();
      Eigen::Matrix3d planes = Eigen::Matrix3d::Zero();
      double of_source = 0.0, of_target = 0.0;
      for (Eigen::Index i = 0; i < source.cols(); ++i) {
        const double weight = weightAt(source.col(i));
        const Eigen::Matrix3d plane = source_normals.col(i) * source_normals.col(i).transpose();
        forth += weight * to_target.col(i);
        deformed += weight * deformation.col(i);
        planes += weight * plane;
        to_plane += weight * plane * to_target.col(i);
        of_source += weight;
      }
      for (Eigen::Index j = 0; j < target.cols(); ++j) {
        const double weight = weightAt(target.col(j) + to_source.col(j));
        back -= weight * to_source.col(j);
        of_target += weight;
      }
      vectors.push_back(forth / of_source);
      vectors.push_back(back / (of_target + kFlowFewest));
      vectors.push_back(deformed / of_source);
      const Eigen::Matrix3d ridge = kFlowPlaneRidge * Eigen::Matrix3d::Identity();
      vectors.push_back((planes / of_source + ridge).ldlt().solve(to_plane / of_source));
      shares.push_back(ratio * of_target / of_source);
    }
    Eigen::Index row = 0;
    for (const double value : query) inputs(row++, q) = value;
    for (const double share : shares) inputs(row++, q) = share;
    for (const auto& vector : vectors) {
      for (const double value : vector) inputs(row++, q) = value;
    }
    for (const auto& vector : vectors) inputs(row++, q) = vector.norm();
  }
  return inputs;
}

inline Eigen::Matrix3Xd flow(const Weights& weights, const MovingCloud& source,
                             const Eigen::Matrix3Xd& target, const MovingCloud& queries) {
  Eigen::MatrixXd of_target(kFlowTargetInputs, target.cols());
  of_target << target, offsets(target, source.reached);
  const Eigen::VectorXd both =
      features(weights, "flow", surroundings(source, target, source), of_target);
  const Eigen::MatrixXd read = surroundings(source, target, queries);
  Eigen::MatrixXd inputs(kFlowInputs + both.size(), queries.reached.cols());
  inputs << read, both.replicate(1, queries.reached.cols());
  const Eigen::MatrixXd outputs = decode(weights, "flow.decoder", inputs);
  Eigen::Matrix3Xd moved = outputs.topRows(3);
  for (int k = 0; k < kFlowVectors; ++k) {
    const auto vectors = read.middleRows(kFlowFirstVector + 3 * k, 3);
    moved += vectors * outputs.row(3 + k).asDiagonal();
  }
  return moved;
}

/// Moves source and queries along the flow, as often as a stage does.
inline void followFlow(const Weights& weights, MovingCloud& source, const Eigen::Matrix3Xd& target,
                       MovingCloud& queries) {
  for (int step = 0; step < kFlowSteps; ++step) {
    const Eigen::Matrix3Xd of_source = flow(weights, source, target, source);
    queries.reached += flow(weights, source, target, queries);
    source.reached += of_source;
  }
}

/// What the rigid stage of the flow module reads of a cloud.
inline Points thinned(const Points& points) {
  std::vector<Eigen::Vector3f> sorted(static_cast<std::size_t>(points.cols()));
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    sorted[i] = points.col(static_cast<Eigen::Index>(i));
  }
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return std::tie(a[0], a[1], a[2]) < std::tie(b[0], b[1], b[2]);
  });
  const auto stride = static_cast<std::size_t>(flowRigidStride(points.cols()));
  Points kept(3, static_cast<Eigen::Index>((sorted.size() + stride - 1) / stride));
  for (Eigen::Index i = 0; i < kept.cols(); ++i) {
    kept.col(i) = sorted[static_cast<std::size_t>(i) * stride];
  }
  return kept;
}

/// The accumulated transform after each iteration.
inline std::vector<Eigen::Isometry3d> estimateRigid(const Weights& weights,
                                                    const Points& source_points,
                                                    const Points& target_points, int iterations) {
  const bool by_flow = weights.pairing == Pairing::kOffsets;
  const Points source = by_flow ? thinned(source_points) : source_points;
  const Eigen::Matrix3Xd target = (by_flow ? thinned(target_points) : target_points).cast<double>();
  std::vector<Eigen::Isometry3d> iterates;
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  for (int i = 0; i < iterations; ++i) {
    const Eigen::Matrix3Xd moved = transform * source.cast<double>();
    Eigen::Isometry3d step;
    if (by_flow) {
      MovingCloud cloud(moved), none(Eigen::Matrix3Xd(3, 0));
      followFlow(weights, cloud, target, none);
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
    if (by_flow && motion < static_cast<double>(kFlowConverged)) break;
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
    followFlow(weights, cloud, target, moving_queries);
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

/// Random weights whose every bias counts and whose outputs are large enough to show an error.
inline std::shared_ptr<const Weights> makeLoudWeights(Pairing pairing) {
  auto weights = std::make_shared<Weights>(randomWeights(pairing, 11));
  Random random(12);
  for (auto& [name, layer] : weights->layers) {
    for (Eigen::Index k = 0; k < layer.bias.size(); ++k) {
      layer.bias[k] += static_cast<float>(0.1 * random.normal());
    }
  }
  if (pairing == Pairing::kOffsets) {
    weights->layers.at("flow.decoder.3").weight *= 3.0F;
  } else {
    weights->layers.at("nonrigid.decoder.5").weight *= 20.0F;
  }
  return weights;
}

/// The same, made once for each pairing.
inline std::shared_ptr<const Weights> loudWeights(Pairing pairing) {
  static std::map<Pairing, std::shared_ptr<const Weights>> made;
  auto& weights = made[pairing];
  if (!weights) {
    weights = makeLoudWeights(pairing);
  }
  return weights;
}

inline Points randomPoints(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  return Points::NullaryExpr(3, count, [&] { return static_cast<float>(random.uniform(-1, 1)); });
}

/// Points on an ellipsoid: normals that no rounding turns.
inline Points surfacePoints(Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  Points points(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    points.col(i) = random.direction().cwiseProduct(Eigen::Vector3d(0.5, 0.35, 0.25)).cast<float>();
  }
  return points;
}

/// A permutation of 0 .. count - 1.
inline std::vector<Eigen::Index> shuffled(Eigen::Index count, std::uint64_t seed) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  Random random(seed);
  for (std::size_t i = order.size(); i > 1; --i) {
    std::swap(order[i - 1], order[static_cast<std::size_t>(random.below(static_cast<long>(i)))]);
  }
  return order;
}

}  // namespace unirit::reference
