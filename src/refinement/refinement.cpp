// SPDX-License-Identifier: BSD-3-Clause
#include "refinement.hpp"

#include <algorithm>
#include <cmath>

#include "unirit/metrics.hpp"
#include "unirit/normals.hpp"

namespace unirit {
namespace {

// Lengths in half extents of the organ. The prior's are the covariance that random thin-plate
// deformations of training organs have; the others gave the smallest errors on such organs.
constexpr double kPriorLength = 0.4;
constexpr double kPriorAmplitude = 0.087;
constexpr int kRank = 48;
// A view tells little of the pose, a whole surface nearly all
constexpr PosePrior kViewPose{0.07F, 0.035F};
constexpr PosePrior kWholePose{0.2F, 0.1F};
constexpr float kWidestSigma = 0.4F;    // where the pose alone is sought
constexpr float kFirstSigma = 0.12F;    // where the displacement joins it
constexpr float kSurfaceAcross = 0.2F;  // deviation along the surface, which geometry hardly sees
constexpr float kPointsAcross = 0.01F;
constexpr int kPointsPatience = 2;  // times the iterations: points are told apart late
constexpr float kSurfaceWeight = 0.3F;
// Mean normal of a surface seen from all sides, at most; a viewpoint speaks for one side
constexpr double kWholeOpenness = 0.25;
constexpr double kWholeOpennessFromViewpoint = 0.1;
constexpr float kNearby = 0.1F;         // a point without a neighbour within it is not seen
constexpr float kFar = 8.0F;            // a viewpoint that is not known lies so far away
constexpr float kGrazingCosine = 0.2F;  // surely seen from kGrazingCosine + kGrazingRange on
constexpr float kGrazingRange = 0.3F;

/// Geometric sequence from `first` to `last` in `steps`.
float annealed(float first, float last, int step, int steps) {
  if (step >= steps) return last;
  return first * std::pow(last / first, static_cast<float>(step) / static_cast<float>(steps));
}

/// Whether the outward normals look to the viewpoint on the whole; from a wrong one, such as that
/// of another frame, they mostly look away.
bool faces(const PointCloud& seen, const Eigen::Vector3f& viewpoint) {
  const Points rays = ((-seen.points).colwise() + viewpoint).colwise().normalized();
  return seen.normals.cwiseProduct(rays).sum() > 0.0F;
}

}  // namespace

Refinement::Refinement(const PointCloud& source, const RefinementSettings& settings,
                       const Kernels& kernels, ThreadTeam& team)
    : source_(source),
      settings_(settings),
      kernels_(kernels),
      team_(team),
      prior_(std::make_shared<const DisplacementPrior>(source.points, kPriorLength, kPriorAmplitude,
                                                       kRank)),
      solver_(source.points, prior_->functions(source.points), kViewPose, kernels, team) {}

void Refinement::move(const CoherentState& state) {
  moved_.points = state.pose * (source_.points + state.displacements);
  moved_.normals = state.pose.linear() * source_.normals;
}

/// How sure it is that the camera sees each point: whether it faces it.
Eigen::RowVectorXf Refinement::visibility(const PointCloud& moved,
                                          const std::optional<Eigen::Vector3f>& viewpoint) const {
  if (!viewpoint) return Eigen::RowVectorXf::Ones(moved.size());
  const Points rays = ((-moved.points).colwise() + *viewpoint).colwise().normalized();
  const Eigen::RowVectorXf cosines = moved.normals.cwiseProduct(rays).colwise().sum();
  return ((cosines.array() - kGrazingCosine) / kGrazingRange).max(0.0F).min(1.0F);
}

Refined Refinement::refine(const PointCloud& target, const Points& displacements) {
  // A whole surface is seen from all sides, a part from the viewpoint or where its normals point
  PointCloud seen{target.points, outwardNormals(target.points)};
  const bool known = target.viewpoint && faces(seen, *target.viewpoint);
  const bool whole =
      openness(seen.normals) < (known ? kWholeOpennessFromViewpoint : kWholeOpenness);
  std::optional<Eigen::Vector3f> eye;
  if (!whole) {
    eye = known ? *target.viewpoint
                : Eigen::Vector3f(centroid(seen.points) +
                                  kFar * seen.normals.rowwise().mean().normalized());
    orientTowards(seen.points, *eye, seen.normals);
  }

  CorrespondenceEstimator estimator(seen, kernels_, team_);
  const bool points = settings_.correspondence == Correspondence::kPoints;
  Attraction attraction;
  attraction.normals = whole ? NormalUse::kUnsigned : NormalUse::kSigned;
  if (points) {
    attraction.normals = NormalUse::kNone;
    attraction.symmetry = 0.0F;
  }
  solver_.restart(whole ? kWholePose : kViewPose);
  CoherentState state{Eigen::Isometry3f::Identity(), Eigen::Matrix3Xf::Zero(3, solver_.rank()),
                      displacements};
  const auto expect = [&](float sigma) {
    attraction.sigma = sigma;
    move(state);
    estimator.estimate(moved_, visibility(moved_, eye), attraction, correspondences_);
  };
  const auto trust = [&](float sigma, float across) {
    return Trust{sigma, std::hypot(across, sigma), points ? 1.0F : kSurfaceWeight};
  };

  const auto last = static_cast<float>(settings_.last_sigma);
  const int pose_steps = whole ? settings_.pose_iterations : 0;
  for (int step = 0; step < pose_steps; ++step) {
    const float sigma = annealed(kWidestSigma, kFirstSigma, step, pose_steps);
    expect(sigma);
    solver_.solvePose(correspondences_, trust(sigma, 0.0F), state);
  }
  const int steps = points ? kPointsPatience * settings_.iterations : settings_.iterations;
  for (int step = 0; step < steps; ++step) {
    const float sigma = annealed(kFirstSigma, last, step, steps * 4 / 5);
    expect(sigma);
    solver_.solve(correspondences_, trust(sigma, points ? kPointsAcross : kSurfaceAcross), state);
  }
  expect(last);
  return {state.pose, state.coefficients,   solver_.covarianceFactor(),
          whole,      correspondences_.fit, eye};
}

Agreement Refinement::agreement(const Points& target, const Refined& refined) const {
  const Points bent = source_.points + prior_->displacements(source_.points, refined.coefficients);
  const PointCloud moved{refined.pose * bent, refined.pose.linear() * source_.normals};
  const Eigen::RowVectorXf visible = visibility(moved, refined.eye);
  const Eigen::RowVectorXf lonely =
      (nearestDistances(moved.points, target).array() > kNearby).cast<float>();
  const float rigid = nearestDistances(target, refined.pose * source_.points).norm();
  const float left = nearestDistances(target, moved.points).norm();
  return {lonely.dot(visible) / std::max(visible.sum(), 1.0F), rigid > 0.0F ? left / rigid : 1.0F};
}

}  // namespace unirit
