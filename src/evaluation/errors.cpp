// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/errors.hpp"

#include <cmath>

#include "unirit/metrics.hpp"

namespace unirit {

RegistrationErrors registrationErrors(Registrar& registrar, const RegistrationPair& pair,
                                      const Eigen::Isometry3d& start) {
  const auto moved = [&](const Eigen::Isometry3d& pose) -> Points {
    return (pose * pair.source.cast<double>()).cast<float>();
  };
  const Registration registration =
      registrar.registerClouds({pair.source, pair.source_normals}, {pair.target, Points()}, start);
  RegistrationErrors errors;
  errors.refused = !registration.succeeded();
  const Eigen::Isometry3d pose =
      errors.refused ? start : registration.T_intraoperative_preoperative;
  const Points rigid = moved(pose), best = moved(pair.best_rigid);
  errors.before = rootMeanSquareDistance(moved(start), pair.truth);
  errors.best_rigid = rootMeanSquareDistance(best, pair.truth);
  errors.rigid = rootMeanSquareDistance(rigid, pair.truth);
  errors.final = errors.refused
                     ? errors.before
                     : rootMeanSquareDistance(registration.deformation->movedSurface(), pair.truth);
  errors.pose_before = rootMeanSquareDistance(moved(start), best);
  errors.pose = rootMeanSquareDistance(rigid, best);
  const Eigen::Matrix3d turn = pair.best_rigid.linear().transpose() * pose.linear();
  errors.rotation = Eigen::AngleAxisd(turn).angle() * 180.0 / M_PI;
  const Eigen::Vector3d centre = centroid(pair.source).cast<double>();
  errors.translation = (pose * centre - pair.best_rigid * centre).norm();
  return errors;
}

}  // namespace unirit
