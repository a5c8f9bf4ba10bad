// SPDX-License-Identifier: BSD-3-Clause
#include "expectation.hpp"

#include <cmath>

namespace unirit {
namespace {

constexpr float kWholeSymmetry = 1.0F;  // a view needs more, lest it draw the organ together

Attraction attractionOf(Correspondence correspondence, bool whole) {
  Attraction attraction;
  attraction.normals = whole ? NormalUse::kUnsigned : NormalUse::kSigned;
  if (whole) attraction.symmetry = kWholeSymmetry;
  if (correspondence == Correspondence::kPoints) {
    attraction.normals = NormalUse::kNone;
    attraction.symmetry = 0.0F;
  }
  return attraction;
}

}  // namespace

Expectation::Expectation(const PointCloud& source, Correspondence correspondence,
                         const Kernels& kernels, ThreadTeam& team)
    : source_(source),
      correspondence_(correspondence),
      visibility_(source.points),
      estimator_(kernels, team) {}

void Expectation::look(const Sighting& sighting) {
  attraction_ = attractionOf(correspondence_, sighting.whole);
  eye_ = sighting.eye;
  estimator_.aimAt(sighting.seen);
}

const Correspondences& Expectation::at(const CoherentState& state, float sigma) {
  attraction_.sigma = sigma;
  bent_ = source_.points + state.displacements;
  moved_.points = state.pose.translation().replicate(1, source_.size());
  moved_.points.noalias() += state.pose.linear() * bent_;
  moved_.normals.noalias() = state.pose.linear() * source_.normals;
  visibility_.update(moved_, eye_, visible_);
  estimator_.estimate(moved_, visible_, attraction_, correspondences_);
  turnNormals();
  return correspondences_;
}

/// Halfway to the organ's own normals, as in the symmetric objective of Rusinkiewicz (2019): those
/// of the cloud are estimated from a few noisy points.
void Expectation::turnNormals() {
  for (Eigen::Index i = 0; i < source_.size(); ++i) {
    auto normal = correspondences_.normals.col(i);
    const auto own = moved_.normals.col(i);
    if (normal.isZero()) continue;  // nothing is near
    normal += std::copysign(1.0F, normal.dot(own)) * own;
    normal.normalize();
  }
}

}  // namespace unirit
