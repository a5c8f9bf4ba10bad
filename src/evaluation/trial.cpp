// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/trial.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "unirit/metrics.hpp"
#include "unirit/registration.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

constexpr double kRightError = 0.1;   // over the extent
constexpr double kRightGrowth = 1.1;  // over the error before
constexpr double kNoise = 0.0015;     // of a table top [m]
constexpr double kSmallShare = 0.1;

constexpr std::array<float, 4> kUnits{1000.0F, 0.001F, 100.0F, 0.01F};

Trial trialOf(TrialKind kind, Protocol protocol, RegistrationPair pair) {
  return {kind,
          protocol,
          {std::move(pair.source), std::move(pair.source_normals)},
          {std::move(pair.target), Points(), pair.viewpoint},
          Eigen::Isometry3d::Identity(),
          std::move(pair.truth)};
}

/// Without a truth one starts where a node does that knows nothing else.
void loseTruth(Trial& trial) {
  trial.truth = Points();
  trial.guess = alignCentroids(trial.preoperative, trial.intraoperative);
}

void turnCloud(Trial& trial, double degrees, const Eigen::Vector3d& axis) {
  const Eigen::Translation3d centre(centroid(trial.truth).cast<double>());
  const Eigen::Isometry3d turn =
      centre * Eigen::AngleAxisd(degrees * M_PI / 180.0, axis) * centre.inverse();
  trial.intraoperative.points = moved(turn, trial.intraoperative.points);
  trial.truth = moved(turn, trial.truth);
  if (trial.intraoperative.viewpoint) {
    trial.intraoperative.viewpoint = moved(turn, *trial.intraoperative.viewpoint);
  }
}

void scale(PointCloud& cloud, float factor) {
  cloud.points *= factor;
  if (cloud.viewpoint) *cloud.viewpoint *= factor;
}

void changeUnit(Trial& trial, int number) {
  const float factor = kUnits[static_cast<std::size_t>(number) % kUnits.size()];
  const int which = number / static_cast<int>(kUnits.size()) % 3;
  if (which != 1) scale(trial.intraoperative, factor);
  if (which != 0) scale(trial.preoperative, factor);
}

/// On one side of a plane through its centroid the cloud becomes the other's.
void mixIn(Points other, Random& random, Points& own) {
  const Eigen::Vector3f middle = centroid(own), normal = random.direction().cast<float>();
  other.colwise() += middle - centroid(other);
  std::vector<Eigen::Index> kept, added;
  for (Eigen::Index i = 0; i < own.cols(); ++i) {
    if (normal.dot(own.col(i) - middle) >= 0.0F) kept.push_back(i);
  }
  for (Eigen::Index i = 0; i < other.cols(); ++i) {
    if (normal.dot(other.col(i) - middle) < 0.0F) added.push_back(i);
  }
  Points mixed(3, static_cast<Eigen::Index>(kept.size() + added.size()));
  mixed << select(own, kept), select(other, added);
  own = std::move(mixed);
}

/// Seen from above, about as large as the organ; every second one bears up to four round objects.
PointCloud tableTop(double organ_extent, bool objects, Eigen::Index points, Random& random) {
  const double side = organ_extent * random.uniform(0.6, 1.4);
  Eigen::Matrix4Xd caps(4, objects ? 1 + random.below(4) : 0);  // x, y, radius, height
  for (Eigen::Index i = 0; i < caps.cols(); ++i) {
    const double radius = side * random.uniform(0.08, 0.25);
    caps.col(i) << random.uniform(-0.4, 0.4) * side, random.uniform(-0.4, 0.4) * side, radius,
        radius * random.uniform(0.4, 1.2);
  }
  Points seen(3, points);
  for (Eigen::Index i = 0; i < points; ++i) {
    const double x = random.uniform(-0.5, 0.5) * side, y = random.uniform(-0.35, 0.35) * side;
    double height = 0.0;
    for (Eigen::Index k = 0; k < caps.cols(); ++k) {
      const double away = std::hypot(x - caps(0, k), y - caps(1, k)) / caps(2, k);
      if (away < 1.0) height = std::max(height, caps(3, k) * std::sqrt(1.0 - away * away));
    }
    seen.col(i) = Eigen::Vector3d(x + kNoise * random.normal(), y + kNoise * random.normal(),
                                  height + kNoise * random.normal())
                      .cast<float>();
  }
  Eigen::Isometry3d pose(random.rotation(180.0));
  pose.translation() = 0.1 * organ_extent * random.direction();
  const Eigen::Vector3f above(0.0F, 0.0F, static_cast<float>(2.0 * organ_extent));
  return {moved(pose, seen), Points(), moved(pose, above)};
}

/// Those whose share in view can be chosen.
const std::vector<Protocol>& smallProtocols() {
  static const std::vector<Protocol> protocols{Protocol::kPartial, Protocol::kIntraop};
  return protocols;
}

}  // namespace

const std::vector<Protocol>& ordinaryProtocols() {
  static const std::vector<Protocol> protocols{Protocol::kResampled, Protocol::kCaseB,
                                               Protocol::kPartial, Protocol::kIntraop,
                                               Protocol::kCamera};
  return protocols;
}

const std::vector<TrialKind>& trialKinds() {
  static const std::vector<TrialKind> kinds{
      TrialKind::kOrdinary, TrialKind::kOtherOrgan, TrialKind::kTableTop, TrialKind::kWrongUnit,
      TrialKind::kFarStart, TrialKind::kSmallView,  TrialKind::kHalfOther};
  return kinds;
}

const char* toString(TrialKind kind) {
  switch (kind) {
    case TrialKind::kOrdinary:
      return "ordinary";
    case TrialKind::kOtherOrgan:
      return "other organ";
    case TrialKind::kTableTop:
      return "table top";
    case TrialKind::kWrongUnit:
      return "wrong unit";
    case TrialKind::kFarStart:
      return "far start";
    case TrialKind::kSmallView:
      return "small view";
    case TrialKind::kHalfOther:
      return "half other";
  }
  return "unknown";
}

double Trial::errorBefore() const { return error(moved(guess, preoperative.points)); }

double Trial::error(const Points& moved) const {
  return rootMeanSquareDistance(moved, truth) / extent(preoperative.points);
}

bool Trial::isRight(const Points& moved) const {
  if (truth.cols() == 0) return false;
  const double reached = error(moved);
  return reached <= kRightError && reached <= kRightGrowth * errorBefore();
}

Trial makeTrial(TrialKind kind, int number, const DeformedOrgan& own, const DeformedOrgan& other,
                Eigen::Index points, std::uint64_t seed) {
  const bool small = kind == TrialKind::kSmallView;
  const auto& protocols = small ? smallProtocols() : ordinaryProtocols();
  const Protocol protocol = protocols[static_cast<std::size_t>(number) % protocols.size()];
  View view = viewOf(protocol);
  if (small) view.visible_share = kSmallShare;
  Trial trial = trialOf(kind, protocol, own.pair(view, points, seed));
  Random random(seed + 1);
  switch (kind) {
    case TrialKind::kOrdinary:
    case TrialKind::kSmallView:
      break;
    case TrialKind::kOtherOrgan: {
      const RegistrationPair seen = other.pair(view, points, seed);
      trial.intraoperative = {seen.target, Points(), seen.viewpoint};
      loseTruth(trial);
      break;
    }
    case TrialKind::kTableTop:
      trial.intraoperative =
          tableTop(extent(trial.preoperative.points), number % 2 == 1, points, random);
      loseTruth(trial);
      break;
    case TrialKind::kWrongUnit:
      changeUnit(trial, number);
      loseTruth(trial);
      break;
    case TrialKind::kFarStart:
      turnCloud(trial, random.uniform(60.0, 180.0), random.direction());
      break;
    case TrialKind::kHalfOther:
      mixIn(other.pair(view, points, seed).target, random, trial.intraoperative.points);
      break;
  }
  return trial;
}

}  // namespace unirit
