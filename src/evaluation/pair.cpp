// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/pair.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include "unirit/random.hpp"
#include "unirit/sampling.hpp"
#include "unirit/simulation/thin_plate_spline.hpp"

namespace unirit {
namespace {

constexpr double kDeformation = 0.075;  // RMS over the extent
constexpr Eigen::Index kMeasuredPoints = 1500;
constexpr Eigen::Index kSourcePool = 10000;
constexpr Eigen::Index kInteriorPoints = 200;
constexpr Eigen::Index kSurfaceSamples = 20000;
constexpr double kCameraDistance = 4.0;  // half extents from the organ's centre
constexpr double kOutlierBox = 0.6;      // of the bounding box's sides, from its centre
constexpr std::array<Protocol, 7> kProtocols{
    Protocol::kPaired,  Protocol::kPermuted, Protocol::kResampled, Protocol::kCaseB,
    Protocol::kPartial, Protocol::kOffset,   Protocol::kIntraop};

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

/// The first of the surface's points, drawn towards the centroid at the origin.
Points interiorOf(const Points& surface, Random& random) {
  Points interior = surface.leftCols(std::min(surface.cols(), kInteriorPoints));
  for (Eigen::Index i = 0; i < interior.cols(); ++i) {
    interior.col(i) *= static_cast<float>(random.uniform(0.3, 0.85));
  }
  return interior;
}

Points moved(const Eigen::Isometry3d& pose, const Points& points) {
  return (pose * points.cast<double>()).cast<float>();
}

}  // namespace

const char* toString(Protocol protocol) {
  switch (protocol) {
    case Protocol::kPaired:
      return "paired";
    case Protocol::kPermuted:
      return "permuted";
    case Protocol::kResampled:
      return "resampled";
    case Protocol::kCaseB:
      return "caseb";
    case Protocol::kPartial:
      return "partial";
    case Protocol::kOffset:
      return "offset";
    case Protocol::kIntraop:
      return "intraop";
  }
  return "unknown";
}

Protocol protocolFromString(const std::string& name) {
  for (const Protocol protocol : kProtocols) {
    if (name == toString(protocol)) return protocol;
  }
  throw std::invalid_argument("protocol: unknown protocol '" + name + "'");
}

View viewOf(Protocol protocol) {
  View view;
  switch (protocol) {
    case Protocol::kPaired:
      view.target = View::Target::kPaired;
      break;
    case Protocol::kPermuted:
      view.target = View::Target::kPermuted;
      break;
    case Protocol::kResampled:
      break;
    case Protocol::kOffset:
      view.offset = 0.5;
      [[fallthrough]];
    case Protocol::kCaseB:
      view.rotation = 45.0;
      view.translation = 0.2;
      break;
    case Protocol::kPartial:
      view.visible_share = 0.4;
      break;
    case Protocol::kIntraop:
      view.visible_share = 0.35;
      view.rotation = 20.0;
      view.translation = 0.1;
      view.noise = 0.0015;
      view.outlier_share = 0.05;
      break;
  }
  return view;
}

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
  Surface deformed = centred;
  deformed.vertices.points += spline.displacements(vertices);
  target_pool_ = sampleByArea(deformed, pool, random.next());
  interior_ = interiorOf(measured, random);
  interior_truth_ = interior_ + spline.displacements(interior_);
}

RegistrationPair DeformedOrgan::pair(const View& view, Eigen::Index points, std::uint64_t seed,
                                     Eigen::Index surface_samples) const {
  if (surface_samples > target_pool_.size()) {
    throw std::invalid_argument("surface_samples: more than the pool holds");
  }
  Random random(seed);
  RegistrationPair pair;
  const auto rows = draw(source_pool_.size(), points, random);
  pair.source = select(source_pool_.points, rows);
  pair.source_normals = select(source_pool_.normals, rows);
  pair.truth = select(truth_pool_, rows);

  const Eigen::Vector3f camera =
      (kCameraDistance * half_extent_ * random.direction()).cast<float>();
  if (view.target == View::Target::kPaired) {
    pair.target = pair.truth;
  } else if (view.target == View::Target::kPermuted) {
    pair.target = select(pair.truth, draw(points, points, random));
  } else if (view.visible_share < 1.0) {
    const auto visible = facing(target_pool_, camera, view.visible_share);
    auto seen = draw(static_cast<Eigen::Index>(visible.size()), points, random);
    for (Eigen::Index& index : seen) index = visible[static_cast<std::size_t>(index)];
    pair.target = select(target_pool_.points, seen);
  } else {
    pair.target = select(target_pool_.points, draw(target_pool_.size(), points, random));
  }
  disturb(view, target_pool_, pair.target, random);

  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = random.rotation(view.rotation);
  const double reach = view.translation * half_extent_;
  pose.translation() =
      random.uniformVector(Eigen::Vector3d::Constant(-reach), Eigen::Vector3d::Constant(reach)) +
      view.offset * random.direction();
  pair.target = moved(pose, pair.target);
  pair.truth = moved(pose, pair.truth);
  pair.interior = interior_;
  pair.interior_truth = moved(pose, interior_truth_);
  pair.surface = moved(pose, target_pool_.points.leftCols(surface_samples));
  pair.best_rigid = bestRigidFit(pair.source, pair.truth);
  if (view.visible_share < 1.0) pair.viewpoint = (pose * camera.cast<double>()).cast<float>();
  return pair;
}

RegistrationPair makePair(const Surface& organ, Protocol protocol, Eigen::Index points,
                          std::uint64_t seed) {
  Random random(seed);
  const std::uint64_t organ_seed = random.next();
  return DeformedOrgan(organ, organ_seed)
      .pair(viewOf(protocol), points, random.next(), kSurfaceSamples);
}

Eigen::Isometry3d bestRigidFit(const Points& from, const Points& to) {
  if (from.cols() != to.cols() || from.cols() == 0) {
    throw std::invalid_argument("from, to: must hold the same number of points, at least one");
  }
  return Eigen::Isometry3d(Eigen::umeyama(from.cast<double>(), to.cast<double>(), false));
}

}  // namespace unirit
