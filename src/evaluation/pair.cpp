// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/pair.hpp"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include "unirit/random.hpp"
#include "unirit/sampling.hpp"
#include "unirit/simulation/depth_camera.hpp"
#include "unirit/simulation/thin_plate_spline.hpp"

namespace unirit {
namespace {

constexpr double kDeformation = 0.075;  // RMS over the extent
constexpr Eigen::Index kMeasuredPoints = 1500;
constexpr Eigen::Index kSourcePool = 10000;
constexpr Eigen::Index kInteriorPoints = 200;
constexpr Eigen::Index kSurfaceSamples = 20000;
constexpr double kCameraDistance = 4.0;  // half extents from the organ's centre
constexpr int kImageWidth = 640;         // large enough for slender organs that are seen end-on
constexpr int kImageHeight = 480;
constexpr double kOutlierBox = 0.6;  // of the bounding box's sides, from its centre

/// `count` of the first `available` indices, without replacement, in random sequence.
std::vector<Eigen::Index> draw(Eigen::Index available, Eigen::Index count, Random& random) {
  if (count > available) throw std::invalid_argument("points: more than the view's pool holds");
  std::vector<Eigen::Index> indices(static_cast<std::size_t>(available));
  std::iota(indices.begin(), indices.end(), 0);
  for (Eigen::Index i = 0; i < count; ++i) {
    std::swap(indices[static_cast<std::size_t>(i)],
              indices[static_cast<std::size_t>(i + random.below(available - i))]);
  }
  indices.resize(static_cast<std::size_t>(count));
  return indices;
}

/// Indices of the share of the surface that faces the camera most.
std::vector<Eigen::Index> facing(const PointCloud& surface, const Eigen::Vector3f& camera,
                                 double share) {
  const Points rays = ((-surface.points).colwise() + camera).colwise().normalized();
  const Eigen::RowVectorXf cosines = surface.normals.cwiseProduct(rays).colwise().sum();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(surface.size()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return cosines[a] > cosines[b]; });
  order.resize(static_cast<std::size_t>(share * static_cast<double>(order.size())));
  return order;
}

void disturb(const View& view, const PointCloud& surface, Points& target, Random& random) {
  if (view.noise > 0.0) {
    target = target.unaryExpr([&](float coordinate) {
      return coordinate + static_cast<float>(view.noise * random.normal());
    });
  }
  const auto outliers =
      static_cast<Eigen::Index>(view.outlier_share * static_cast<double>(target.cols()));
  const Eigen::Vector3d lowest = surface.points.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d highest = surface.points.rowwise().maxCoeff().cast<double>();
  const Eigen::Vector3d centre = (lowest + highest) / 2.0, reach = kOutlierBox * (highest - lowest);
  for (const Eigen::Index i : draw(target.cols(), outliers, random)) {
    target.col(i) = random.uniformVector(centre - reach, centre + reach).cast<float>();
  }
}

/// What a depth camera at `eye` sees of a mesh about the origin, in the mesh's frame.
Points depthImage(const Surface& mesh, const Eigen::Vector3d& eye, const View& view,
                  std::uint64_t seed) {
  DepthCamera camera;
  camera.width = kImageWidth;
  camera.height = kImageHeight;
  camera.max_range = 2.0 * eye.norm();
  camera.depth_noise = view.noise;
  camera.outlier_fraction = view.outlier_share;
  const Eigen::Isometry3d T_mesh_camera =
      lookAt(eye, Eigen::Vector3d::Zero(), eye.unitOrthogonal());
  return moved(T_mesh_camera, renderDepth(mesh, T_mesh_camera.inverse(), camera, seed).points);
}

bool fromOneSide(const View& view) {
  return view.target == View::Target::kDepthImage || view.visible_share < 1.0;
}

/// The first of the surface's points, drawn towards the centroid at the origin.
Points interiorOf(const Points& surface, Random& random) {
  Points interior = surface.leftCols(std::min(surface.cols(), kInteriorPoints));
  for (Eigen::Index i = 0; i < interior.cols(); ++i) {
    interior.col(i) *= static_cast<float>(random.uniform(0.3, 0.85));
  }
  return interior;
}

}  // namespace

DeformedOrgan::DeformedOrgan(const Surface& organ, std::uint64_t seed, Eigen::Index pool) {
  Random random(seed);
  Surface centred = organ;
  centred.vertices.points.colwise() -= centroid(organ.vertices.points);
  const Points& vertices = centred.vertices.points;
  half_extent_ = extent(vertices) / 2.0;
  const Points measured =
      select(vertices, draw(vertices.cols(), std::min(vertices.cols(), kMeasuredPoints), random));
  const ThinPlateSpline spline =
      randomDeformation(measured, kDeformation * 2.0 * half_extent_, random.next());
  source_pool_ = sampleByArea(centred, std::min(pool, kSourcePool), random.next());
  truth_pool_ = source_pool_.points + spline.displacements(source_pool_.points);
  deformed_ = centred;
  deformed_.vertices.points += spline.displacements(vertices);
  target_pool_ = sampleByArea(deformed_, pool, random.next());
  interior_ = interiorOf(measured, random);
  interior_truth_ = interior_ + spline.displacements(interior_);
}

RegistrationPair DeformedOrgan::pair(const View& view, Eigen::Index points, std::uint64_t seed,
                                     Eigen::Index surface_samples) const {
  Random random(seed);
  const DeformedPoints drawn = drawPoints(points, surface_samples, random);
  return joinPair(drawn, see(view, drawn.truth, random));
}

DeformedPoints DeformedOrgan::drawPoints(Eigen::Index points, Eigen::Index surface_samples,
                                         Random& random) const {
  if (surface_samples > target_pool_.size()) {
    throw std::invalid_argument("surface_samples: more than the pool holds");
  }
  const auto rows = draw(source_pool_.size(), points, random);
  return {select(source_pool_.points, rows),
          select(source_pool_.normals, rows),
          select(truth_pool_, rows),
          interior_,
          interior_truth_,
          target_pool_.points.leftCols(surface_samples)};
}

Points DeformedOrgan::targetOf(const View& view, const Eigen::Vector3d& eye, const Points& truth,
                               Random& random) const {
  const Eigen::Index points = truth.cols();
  if (view.target == View::Target::kPaired) return truth;
  if (view.target == View::Target::kPermuted) return select(truth, draw(points, points, random));
  if (view.target == View::Target::kDepthImage) {
    const Points image = depthImage(deformed_, eye, view, random.next());
    return select(image, draw(image.cols(), points, random));
  }
  if (view.visible_share >= 1.0) {
    return select(target_pool_.points, draw(target_pool_.size(), points, random));
  }
  const auto visible = facing(target_pool_, eye.cast<float>(), view.visible_share);
  auto seen = draw(static_cast<Eigen::Index>(visible.size()), points, random);
  for (Eigen::Index& index : seen) index = visible[static_cast<std::size_t>(index)];
  return select(target_pool_.points, seen);
}

Sight DeformedOrgan::see(const View& view, const Points& truth, Random& random) const {
  const Eigen::Vector3d eye = kCameraDistance * half_extent_ * random.direction();
  Sight sight;
  sight.target = targetOf(view, eye, truth, random);
  if (view.target != View::Target::kDepthImage) disturb(view, target_pool_, sight.target, random);

  sight.pose = Eigen::Isometry3d::Identity();
  sight.pose.linear() = random.rotation(view.rotation);
  const double reach = view.translation * half_extent_;
  sight.pose.translation() =
      random.uniformVector(Eigen::Vector3d::Constant(-reach), Eigen::Vector3d::Constant(reach)) +
      view.offset * random.direction();
  sight.target = moved(sight.pose, sight.target);
  if (fromOneSide(view)) sight.viewpoint = (sight.pose * eye).cast<float>();
  return sight;
}

RegistrationPair joinPair(const DeformedPoints& points, const Sight& sight) {
  RegistrationPair pair;
  pair.source = points.source;
  pair.source_normals = points.source_normals;
  pair.target = sight.target;
  pair.truth = moved(sight.pose, points.truth);
  pair.interior = points.interior;
  pair.interior_truth = moved(sight.pose, points.interior_truth);
  pair.surface = moved(sight.pose, points.surface);
  pair.best_rigid = bestRigidFit(pair.source, pair.truth);
  pair.viewpoint = sight.viewpoint;
  return pair;
}

SeenOrgan makeSeenOrgan(const Surface& organ, const std::vector<Protocol>& protocols,
                        Eigen::Index points, Eigen::Index surface_samples, std::uint64_t seed) {
  Random random(seed);
  const DeformedOrgan deformed(organ, random.next());
  Random draws(random.next());
  SeenOrgan seen{deformed.drawPoints(points, surface_samples, draws), {}};
  for (const Protocol protocol : protocols) {
    Random own = draws;  // every protocol goes on from the same draws
    seen.sights.push_back(deformed.see(viewOf(protocol), seen.points.truth, own));
  }
  return seen;
}

RegistrationPair makePair(const Surface& organ, Protocol protocol, Eigen::Index points,
                          std::uint64_t seed) {
  return makePair(organ, viewOf(protocol), points, seed);
}

RegistrationPair makePair(const Surface& organ, const View& view, Eigen::Index points,
                          std::uint64_t seed) {
  Random random(seed);
  const DeformedOrgan deformed(organ, random.next());
  return deformed.pair(view, points, random.next(), kSurfaceSamples);
}

Eigen::Isometry3d bestRigidFit(const Points& from, const Points& to) {
  if (from.cols() != to.cols() || from.cols() == 0) {
    throw std::invalid_argument("from, to: must hold the same number of points, at least one");
  }
  return Eigen::Isometry3d(Eigen::umeyama(from.cast<double>(), to.cast<double>(), false));
}

}  // namespace unirit
