// SPDX-License-Identifier: BSD-3-Clause
#include "refinement.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "unirit/metrics.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

// Lengths in half extents of the organ, but the first. The prior's are the covariance that random
// thin-plate deformations of training organs have; the others gave the smallest errors on such
// organs.
constexpr double kPriorLength = 0.28;  // in mean sides of the organ's box
constexpr double kPriorAmplitude = 0.087;
constexpr int kRank = 48;
// A view tells little of the pose, a whole surface nearly all
constexpr PosePrior kViewPose{0.07F, 0.035F};
constexpr PosePrior kWholePose{0.2F, 0.1F};
constexpr Eigen::Index kCoarsePoints = 256;  // where the search begins afar
constexpr float kWidestSigma = 0.4F;         // where the pose alone is sought
constexpr float kFirstSigma = 0.12F;         // where pose and displacement are sought
constexpr float kNarrowSigma = 0.06F;        // where either ends that has few points
constexpr float kNearSigma = 0.04F;          // where the search begins near its end
constexpr float kTrialSigma = 0.2F;          // where the search begins for a pose that is tried out
constexpr int kTrialIterations = 8;
constexpr float kStride = 1.8F;           // of all iterations of both but the last: over-relaxation
constexpr float kWholeSharpness = 0.75F;  // last sigma of a whole surface over that of a view
constexpr float kSurfaceAcross = 0.3F;    // deviation along the surface, which geometry hardly sees
constexpr float kPointsAcross = 0.01F;
constexpr int kPointsPatience = 2;  // times the iterations: points are told apart late
constexpr float kSurfaceWeight = 0.4F;
constexpr float kNearby = 0.1F;           // a point without a neighbour within it is not seen,
constexpr float kNearbyPoints = 1024.0F;  // of so many; fewer lie farther apart

/// Geometric sequence from `first` to `last` in `steps`.
float annealed(float first, float last, int step, int steps) {
  if (step >= steps) return last;
  return first * std::pow(last / first, static_cast<float>(step) / static_cast<float>(steps));
}

PointCloud pick(const PointCloud& cloud, const std::vector<Eigen::Index>& samples) {
  return {select(cloud.points, samples), select(cloud.normals, samples)};
}

Sighting pickFew(const Sighting& sighting) {
  return {pick(sighting.seen, sampleEvenly(sighting.seen.points, kCoarsePoints)), sighting.whole,
          sighting.eye};
}

PosePrior priorOf(const Sighting& sighting) { return sighting.whole ? kWholePose : kViewPose; }

/// In columns.
Eigen::Matrix3f principalAxes(const Points& points) {
  const Points centred = points.colwise() - centroid(points);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(centred * centred.transpose())
      .eigenvectors();
}

/// Half turns about the principal axes.
std::array<Eigen::Isometry3f, 3> flipsOf(const Points& points) {
  const Eigen::Matrix3f axes = principalAxes(points);
  const Eigen::Translation3f centre(centroid(points));
  const auto flip = [&](int axis) -> Eigen::Isometry3f {
    const Eigen::AngleAxisf half_turn(static_cast<float>(M_PI), axes.col(axis));
    return centre * half_turn * centre.inverse();
  };
  return {flip(0), flip(1), flip(2)};
}

/// Geometric mean of the sides of a box along the principal axes.
double boxSide(const Points& points) {
  const Points along = principalAxes(points).transpose() * points;
  const Eigen::Vector3f sides = along.rowwise().maxCoeff() - along.rowwise().minCoeff();
  return std::cbrt(static_cast<double>(sides.prod()));
}

}  // namespace

Eigen::Isometry3f beyondExpectation(const Eigen::Isometry3f& pose) {
  const Eigen::Quaternionf rotation(pose.linear());
  const float turn = rotation.angularDistance(Eigen::Quaternionf::Identity());
  const float shift = pose.translation().norm();
  const float share =
      std::max({0.0F, 1.0F - kViewPose.rotation / turn, 1.0F - kViewPose.translation / shift});
  return Eigen::Translation3f(share * pose.translation()) *
         Eigen::Quaternionf::Identity().slerp(share, rotation);
}

Refinement::Refinement(const PointCloud& source, const RefinementSettings& settings,
                       const Kernels& kernels, ThreadTeam& team)
    : source_(source),
      coarse_samples_(sampleEvenly(source.points, kCoarsePoints)),
      coarse_(pick(source, coarse_samples_)),
      settings_(settings),
      area_(sampledArea(source.points)),
      flips_(flipsOf(source.points)),
      prior_(std::make_shared<const DisplacementPrior>(
          source.points, kPriorLength * boxSide(source.points), kPriorAmplitude, kRank)),
      expectation_(source_, settings.correspondence, kernels, team),
      coarse_expectation_(coarse_, settings.correspondence, kernels, team),
      solver_(source.points, prior_->functions(source.points), kViewPose, kernels, team),
      coarse_solver_(coarse_.points, prior_->functions(coarse_.points), kViewPose, kernels, team) {}

Trust Refinement::trust(float sigma) const {
  const bool points = settings_.correspondence == Correspondence::kPoints;
  const float across = points ? kPointsAcross : kSurfaceAcross;
  return {sigma, std::hypot(across, sigma), points ? 1.0F : kSurfaceWeight};
}

/// With few points, without a change of the displacement.
void Refinement::seekPose(float first_sigma, int iterations) {
  for (int step = 0; step < iterations; ++step) {
    const float sigma = annealed(first_sigma, kNarrowSigma, step, iterations);
    coarse_solver_.solvePose(coarse_expectation_.at(coarse_state_, sigma),
                             {sigma, sigma, kSurfaceWeight}, coarse_state_);
  }
}

/// With few points, from wide to narrow: the pose alone, then `iterations` of both.
void Refinement::searchCoarsely(const Sighting& sighting, const PosePrior& prior,
                                const SearchStart& start, int iterations) {
  coarse_expectation_.look(pickFew(sighting));
  coarse_solver_.restart(prior);
  coarse_state_.pose = start.pose;
  coarse_state_.coefficients.setZero(3, coarse_solver_.rank());
  coarse_state_.displacements = select(start.displacements, coarse_samples_);
  seekPose(kWidestSigma, settings_.pose_iterations);
  for (int step = 0; step < iterations; ++step) {
    const float sigma = annealed(kFirstSigma, kNarrowSigma, step, iterations);
    Trust each = trust(sigma);
    each.weight *= static_cast<float>(source_.size()) / static_cast<float>(coarse_.size());
    coarse_solver_.solve(coarse_expectation_.at(coarse_state_, sigma), each, coarse_state_,
                         kStride);
  }
}

/// Leaves the state where the search with all points begins.
Refinement::FineSearch Refinement::prepareFineSearch(const Sighting& sighting,
                                                     const PosePrior& prior,
                                                     const SearchStart& start) {
  const bool points = settings_.correspondence == Correspondence::kPoints;
  const int patience = points ? kPointsPatience : 1;
  state_.pose = start.pose;
  state_.coefficients.setZero(3, solver_.rank());
  state_.displacements = start.displacements;
  if (start.near) return {kNearSigma, patience * settings_.warm_iterations};

  const int steps = patience * settings_.iterations;
  const int coarse_steps = points ? 0 : steps / 2;  // of few, points are not told apart
  searchCoarsely(sighting, prior, start, coarse_steps);
  state_.pose = coarse_state_.pose;
  if (coarse_steps == 0) return {kFirstSigma, steps};
  state_.coefficients = coarse_state_.coefficients;
  solver_.displace(state_);
  return {kNarrowSigma, steps - coarse_steps};
}

Refined Refinement::refine(const Sighting& sighting, const SearchStart& start) {
  Refined refined;
  refine(sighting, start, refined);
  return refined;
}

void Refinement::refine(const Sighting& sighting, const SearchStart& start, Refined& refined) {
  const PosePrior prior = priorOf(sighting);
  const auto [first, steps] = prepareFineSearch(sighting, prior, start);

  expectation_.look(sighting);
  solver_.restart(prior);
  const bool points = settings_.correspondence == Correspondence::kPoints;
  const float last = static_cast<float>(settings_.last_sigma) *
                     (sighting.whole && !points ? kWholeSharpness : 1.0F);
  for (int step = 0; step < steps; ++step) {
    const float sigma = annealed(first, last, step, steps * 4 / 5);
    solver_.solve(expectation_.at(state_, sigma), trust(sigma), state_,
                  step + 1 < steps ? kStride : 1.0F);
  }
  refined.pose = state_.pose;
  refined.coefficients = state_.coefficients;
  solver_.covarianceFactor(refined.covariance_factor);
  // At the same sigma for whole surfaces and views, to be compared
  refined.fit = expectation_.at(state_, static_cast<float>(settings_.last_sigma)).fit;
}

/// The best fit about a pose, without a displacement.
double Refinement::fitNear(const Eigen::Isometry3f& pose, const Sighting& few) {
  coarse_expectation_.look(moved(pose.inverse(), few));
  coarse_solver_.restart(priorOf(few));
  coarse_state_.pose.setIdentity();
  coarse_state_.displacements.setZero(3, coarse_.size());
  seekPose(kTrialSigma, kTrialIterations);
  return coarse_expectation_.at(coarse_state_, kNarrowSigma).fit;
}

/// A cloud that does not face its viewpoint is a hollow seen from within, or the viewpoint is
/// wrong; without one it may have been seen from either side.
Sighting Refinement::sight(const PointCloud& target) {
  const Sighting sighting = sightingOf(target, area_);
  if (sighting.whole || sighting.eye == target.viewpoint) return sighting;
  const Eigen::Vector3f opposite = 2.0F * centroid(target.points) - *sighting.eye;
  const Eigen::Vector3f other = target.viewpoint.value_or(opposite);
  const auto start = Eigen::Isometry3f::Identity();
  const Sighting few = pickFew(sighting);
  const bool hollow = fitNear(start, seenFrom(other, few)) > fitNear(start, few);
  return hollow ? seenFrom(other, sighting) : sighting;
}

double Refinement::flipGain(const Sighting& sighting, const Eigen::Isometry3f& pose) {
  const Sighting few = pickFew(sighting);
  double best = -std::numeric_limits<double>::infinity();
  for (const Eigen::Isometry3f& flip : flips_) best = std::max(best, fitNear(pose * flip, few));
  return best - fitNear(pose, few);
}

Agreement Refinement::agreement(const Sighting& sighting, const Refined& refined) const {
  const Points& target = sighting.seen.points;
  const Points bent = source_.points + prior_->displacements(source_.points, refined.coefficients);
  const PointCloud moved{refined.pose * bent, refined.pose.linear() * source_.normals};
  const Eigen::RowVectorXf visible = expectation_.visibility().of(moved, sighting.eye);
  const float sparseness = kNearbyPoints / static_cast<float>(target.cols());
  const float reach = kNearby * std::sqrt(std::max(sparseness, 1.0F));
  const Eigen::RowVectorXf lonely =
      (nearestDistances(moved.points, target).array() > reach).cast<float>();
  const float rigid = nearestDistances(target, refined.pose * source_.points).norm();
  const float left = nearestDistances(target, moved.points).norm();
  return {lonely.dot(visible) / std::max(visible.sum(), 1.0F), rigid > 0.0F ? left / rigid : 1.0F};
}

}  // namespace unirit
