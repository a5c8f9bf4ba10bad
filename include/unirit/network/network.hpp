// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "unirit/network/weights.hpp"
#include "unirit/point_cloud.hpp"
#include "unirit/settings.hpp"

namespace unirit {

/// Similarity that takes metres to the network's unit: (p - offset) / scale.
struct Normalisation {
  Eigen::Vector3f offset = Eigen::Vector3f::Zero();  ///< centroid of the source [m]
  float scale = 1.0F;                                ///< its largest absolute coordinate [m]

  /// Of a source cloud; throws std::invalid_argument where it is empty or a single point.
  static Normalisation of(const Points& source);
  Points apply(const Points& points) const;
};

/// The forward pass of UniRiT in the network's own unit. Holds buffers that grow to the largest
/// clouds seen and then allocates no more; not thread-safe, use one per thread. The same input
/// gives the same bits for any number of threads.
class Network {
 public:
  /// Throws std::invalid_argument where settings.pairing is not the weights' own.
  Network(std::shared_ptr<const Weights> weights, const NetworkSettings& settings, int threads);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  /// Rigid stage: the transform that takes `source` to `target` (3 x N and 3 x M, N and M free).
  /// Throws std::invalid_argument where a cloud is empty or not finite, std::runtime_error where
  /// what the network puts out is no rotation or not finite.
  /// `iterates`, if given, gets the accumulated transform after each iteration (for tests).
  Eigen::Isometry3f estimateRigid(const Points& source, const Points& target,
                                  std::vector<Eigen::Isometry3f>* iterates = nullptr);

  /// The same without the flow module's last, fine iteration: near enough for a search that goes on
  /// from there, in a fraction of the time. The published layers have no such iteration.
  Eigen::Isometry3f estimateRigidCoarsely(const Points& source, const Points& target);

  /// Non-rigid stage: displacement of each of `queries` (3 x Q) given the rigidly moved `source`
  /// and `target`. With pairing row, queries must be the source and of the target's size. Throws
  /// as estimateRigid does.
  Points estimateDisplacements(const Points& source, const Points& target, const Points& queries);

  /// The same into `displacements`, which is resized: no memory is allocated where its size fits.
  void estimateDisplacements(const Points& source, const Points& target, const Points& queries,
                             Points& displacements);

  /// Global features of the last call of either stage, of the source, then of the target (for
  /// tests).
  const Eigen::VectorXf& rigidFeatures() const;
  const Eigen::VectorXf& nonRigidFeatures() const;

  const Weights& weights() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Multiply-adds of the layers in one forward pass with n rigid iterations, as published and with
/// the exact savings (the published rigid module's target feature once, in both counts; the
/// decoder's global columns once per pair). What the flow module reads about the points is not
/// counted.
double multiplyAdds(Eigen::Index source_points, Eigen::Index target_points, int rigid_iterations,
                    Pairing pairing, bool with_savings);

}  // namespace unirit
