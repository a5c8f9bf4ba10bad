// SPDX-License-Identifier: BSD-3-Clause
#include "organ_model.hpp"

#include "unirit/normals.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

bool same(const Points& a, const Points& b) { return a.cols() == b.cols() && a == b; }

/// The cloud's own normals, or estimated ones turned outwards.
Points normalsOf(const PointCloud& cloud, const std::vector<Eigen::Index>& samples) {
  if (cloud.normals.cols() > 0) return select(cloud.normals, samples);
  return outwardNormals(select(cloud.points, samples));
}

}  // namespace

OrganModel::OrganModel(const PointCloud& organ, const RegistrationSettings& settings,
                       ThreadTeam& team)
    : cloud(organ), extent(unirit::extent(organ.points)), sample_count(settings.sampling.points) {
  const auto indices = sampleEvenly(organ.points, sample_count);
  samples = select(organ.points, indices);
  normalisation = Normalisation::of(samples);
  sampled = {normalisation.apply(samples), normalsOf(organ, indices)};
  vertices = normalisation.apply(organ.points);
  if (!settings.runs(Stage::kRefine)) return;
  refinement = std::make_unique<Refinement>(sampled, settings.refinement, selectKernels(), team);
  functions = refinement->prior()->functions(vertices, team);
}

bool OrganModel::isOf(const PointCloud& organ) const {
  return same(cloud.points, organ.points) && same(cloud.normals, organ.normals);
}

PointCloud OrganModel::sample(const PointCloud& seen,
                              const Eigen::Isometry3d& T_organ_cloud) const {
  const auto toNetwork = [&](const Points& points) {
    return normalisation.apply(moved(T_organ_cloud, points));
  };
  PointCloud few{toNetwork(select(seen.points, sampleEvenly(seen.points, sample_count))), {}};
  if (seen.viewpoint) few.viewpoint = toNetwork(*seen.viewpoint);
  return few;
}

Eigen::Isometry3d OrganModel::toMetres(const Eigen::Isometry3f& motion) const {
  const Eigen::Vector3d offset = normalisation.offset.cast<double>();
  Eigen::Isometry3d metres = motion.cast<double>();
  metres.linear() = Eigen::Quaterniond(metres.linear()).normalized().toRotationMatrix();
  metres.translation() = static_cast<double>(normalisation.scale) * metres.translation() + offset -
                         metres.linear() * offset;
  return metres;
}

Eigen::Isometry3f OrganModel::toUnit(const Eigen::Isometry3d& motion) const {
  const Eigen::Vector3d offset = normalisation.offset.cast<double>();
  Eigen::Isometry3d unit = motion;
  unit.translation() = (motion * offset - offset) / static_cast<double>(normalisation.scale);
  return unit.cast<float>();
}

}  // namespace unirit
