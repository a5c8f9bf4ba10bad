// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "coherent_solver.hpp"
#include "displacement_prior.hpp"
#include "expectation.hpp"
#include "sighting.hpp"
#include "unirit/settings.hpp"

namespace unirit {

/// What the refinement found: p -> pose * (p + prior->displacements(p, coefficients)).
struct Refined {
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  Eigen::Matrix3Xf coefficients;      ///< 3 x rank
  Eigen::MatrixXf covariance_factor;  ///< CoherentSolver::covarianceFactor
  double fit = 0.0;                   ///< Correspondences::fit at the end
};

/// Where a search begins. The pose is expected about the identity, wherever it begins.
struct SearchStart {
  Eigen::Isometry3f pose = Eigen::Isometry3f::Identity();
  Points displacements = {};  ///< 3 x N, of the source, before the pose
  bool near = false;          ///< the end is near: the search is short
};

/// As much of a pose as lies beyond one deviation of the pose that is expected of a view.
Eigen::Isometry3f beyondExpectation(const Eigen::Isometry3f& pose);

/// How far a refined organ and the cloud agree, beside the likelihood that was sought.
struct Agreement {
  double missing = 0.0;        ///< RefinementQuality::missing
  double residual_left = 1.0;  ///< RefinementQuality::residual_left
};

/// The coherent refinement: expectation maximisation of pose and smooth displacement, annealed from
/// coarse to fine. It works in the network's unit, half the organ's extent. Holds what depends on
/// the organ alone; not thread-safe.
class Refinement {
 public:
  /// `source`: 3 x N samples of the organ with outward normals.
  Refinement(const PointCloud& source, const RefinementSettings& settings, const Kernels& kernels,
             ThreadTeam& team);
  Refinement(const Refinement&) = delete;
  Refinement& operator=(const Refinement&) = delete;

  /// `target`: 3 x M samples of what is seen, about where the source lies; normals are estimated;
  /// its viewpoint in the same frame, if known.
  Sighting sight(const PointCloud& target);

  /// What is seen lies about where the source does.
  Refined refine(const Sighting& sighting, const SearchStart& start);

  /// The same, written over an earlier result; from a near start it allocates nothing then.
  void refine(const Sighting& sighting, const SearchStart& start, Refined& refined);

  /// What the fit gains where the organ is flipped, half a turn about a principal axis: the best of
  /// three such starts over `pose`, each moved to where the organ fits best without a displacement.
  double flipGain(const Sighting& sighting, const Eigen::Isometry3f& pose);

  /// `refined` to what was seen, in the same frame.
  Agreement agreement(const Sighting& sighting, const Refined& refined) const;

  const std::shared_ptr<const DisplacementPrior>& prior() const { return prior_; }
  const PointCloud& source() const { return source_; }

 private:
  /// With what sigma the search with all points begins, and how long it takes.
  struct FineSearch {
    float first_sigma;
    int iterations;
  };

  FineSearch prepareFineSearch(const Sighting& sighting, const PosePrior& prior,
                               const SearchStart& start);
  void searchCoarsely(const Sighting& sighting, const PosePrior& prior, const SearchStart& start,
                      int iterations);
  void seekPose(float first_sigma, int iterations);
  double fitNear(const Eigen::Isometry3f& pose, const Sighting& few);
  Trust trust(float sigma) const;

  PointCloud source_;
  std::vector<Eigen::Index> coarse_samples_;
  PointCloud coarse_;  // a few of the source's points
  RefinementSettings settings_;
  double area_;
  std::array<Eigen::Isometry3f, 3> flips_;  // half turns about the organ's principal axes
  std::shared_ptr<const DisplacementPrior> prior_;
  Expectation expectation_;
  Expectation coarse_expectation_;
  CoherentSolver solver_;
  CoherentSolver coarse_solver_;
  CoherentState state_;
  CoherentState coarse_state_;
};

}  // namespace unirit
