// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "refinement/refinement.hpp"
#include "unirit/evaluation/pair.hpp"
#include "unirit/network/network.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit::test {

inline const char* const kOrgans[] = {"liver", "kidney", "spleen"};

inline RegistrationPair pairOf(const std::string& organ, Protocol protocol, std::uint64_t seed) {
  return makePair(makePhantom(organ, seed, 3000), protocol, 1024, seed);
}

/// A pair in the network's unit, as a Refinement takes it.
struct Problem {
  explicit Problem(const RegistrationPair& pair)
      : normalisation(Normalisation::of(pair.source)),
        source{normalisation.apply(pair.source), pair.source_normals},
        target{normalisation.apply(pair.target), {}} {
    if (pair.viewpoint) target.viewpoint = Points(normalisation.apply(*pair.viewpoint)).col(0);
  }

  void rotate(const Eigen::Matrix3f& rotation) {
    source.points = rotation * source.points;
    source.normals = rotation * source.normals;
    target.points = rotation * target.points;
    if (target.viewpoint) target.viewpoint = rotation * *target.viewpoint;
  }

  Normalisation normalisation;
  PointCloud source;
  PointCloud target;
};

/// What a refinement made of a problem.
struct Outcome {
  Outcome(const Problem& problem, const RefinementSettings& settings = {}, int threads = 2)
      : team(threads), refinement(problem.source, settings, selectKernels(), team) {
    refine(problem);
  }

  void refine(const Problem& problem) {
    sighting = refinement.sight(problem.target);
    refined = refinement.refine(
        sighting, {Eigen::Isometry3f::Identity(), Points::Zero(3, problem.source.size())});
    const Points& points = problem.source.points;
    moved =
        refined.pose * (points + refinement.prior()->displacements(points, refined.coefficients));
  }

  Points metres(const Normalisation& normalisation) const {
    return (normalisation.scale * moved).colwise() + normalisation.offset;
  }

  ThreadTeam team;
  Refinement refinement;
  Sighting sighting;
  Refined refined;
  Points moved;  // the network's unit
};

}  // namespace unirit::test
