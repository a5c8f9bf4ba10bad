// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "layers_reference.hpp"

/// The flow module and what it reads.
namespace unirit::reference {

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

/// Of the motion of two points, rigid and smoothly deforming.
inline Eigen::Matrix3d motionCovariance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const auto turned = [](const Eigen::Vector3d& p) {
    return (Eigen::Matrix3d() << 0, p[2], -p[1], -p[2], 0, p[0], p[1], -p[0], 0).finished();
  };
  const double deforming = std::pow(kFlowAmplitude, 2) *
                           std::exp(-0.5 * (a - b).squaredNorm() / std::pow(kFlowLength, 2));
  return deforming * Eigen::Matrix3d::Identity() +
         std::pow(kFlowRigidAmplitude, 2) *
             (Eigen::Matrix3d::Identity() + turned(a) * turned(b).transpose());
}

/// The posterior mean of the motion of `queries`, given what takes some points to planes.
inline Eigen::Matrix3Xd coherentWay(const Eigen::Matrix3Xd& source, const Eigen::Matrix3Xd& target,
                                    const Eigen::Matrix3Xd& queries) {
  const Eigen::Index count = std::min<Eigen::Index>(target.cols(), kFlowPlanes);
  const Eigen::Matrix3Xd target_normals = normals(target);
  Eigen::Matrix3Xd points(3, count), planes(3, count);
  Eigen::VectorXd ways(count), noise(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index j = k * target.cols() / count;
    points.col(k) = source.col(nearest(target.col(j), source));
    planes.col(k) = target_normals.col(j);
    const Eigen::Vector3d offset = target.col(j) - points.col(k);
    ways[k] = planes.col(k).dot(offset);
    noise[k] =
        std::pow(kFlowPlaneNoise, 2) * (1.0 + offset.squaredNorm() / std::pow(kFlowPlaneReach, 2));
  }
  Eigen::MatrixXd of_ways = noise.asDiagonal();
  for (Eigen::Index a = 0; a < count; ++a) {
    for (Eigen::Index b = 0; b < count; ++b) {
      of_ways(a, b) +=
          planes.col(a).dot(motionCovariance(points.col(a), points.col(b)) * planes.col(b));
    }
  }
  of_ways.diagonal() += kFlowPlaneRounding * (of_ways.diagonal() - noise);
  const Eigen::VectorXd gains = of_ways.ldlt().solve(ways);
  Eigen::Matrix3Xd motion = Eigen::Matrix3Xd::Zero(3, queries.cols());
  for (Eigen::Index q = 0; q < queries.cols(); ++q) {
    for (Eigen::Index k = 0; k < count; ++k) {
      motion.col(q) += motionCovariance(queries.col(q), points.col(k)) * planes.col(k) * gains[k];
    }
  }
  return motion;
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
  const Eigen::Matrix3Xd way = coherentWay(source, target, queries);
  const double ratio = static_cast<double>(source.cols()) / static_cast<double>(target.cols());
  Eigen::MatrixXd inputs(kFlowInputs, queries.cols());
  for (Eigen::Index q = 0; q < queries.cols(); ++q) {
    const Eigen::Vector3d query = queries.col(q);
    std::vector<Eigen::Vector3d> vectors{offsets(query, target), of_queries.col(q), way.col(q)};
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
  const Eigen::MatrixXd of_source = surroundings(source, target, source);
  const Eigen::VectorXd both = features(weights, "flow", of_source, of_target);
  const Eigen::MatrixXd read =
      &queries == &source ? of_source : surroundings(source, target, queries);
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

/// Moves source and queries along the flow.
inline void followFlow(const Weights& weights, int steps, MovingCloud& source,
                       const Eigen::Matrix3Xd& target, MovingCloud& queries) {
  for (int step = 0; step < steps; ++step) {
    const Eigen::Matrix3Xd of_source = flow(weights, source, target, source);
    if (queries.reached.cols() > 0) queries.reached += flow(weights, source, target, queries);
    source.reached += of_source;
  }
}

/// At most so many points of a cloud, evenly chosen in the order of their coordinates.
inline Points evenly(const Points& points, Eigen::Index at_most) {
  std::vector<Eigen::Vector3f> sorted(static_cast<std::size_t>(points.cols()));
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    sorted[i] = points.col(static_cast<Eigen::Index>(i));
  }
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return std::tie(a[0], a[1], a[2]) < std::tie(b[0], b[1], b[2]);
  });
  Points kept(3, std::min(points.cols(), at_most));
  for (Eigen::Index i = 0; i < kept.cols(); ++i) {
    kept.col(i) = sorted[static_cast<std::size_t>(i * points.cols() / kept.cols())];
  }
  return kept;
}

}  // namespace unirit::reference
