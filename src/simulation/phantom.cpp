// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/phantom.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "implicit_surface.hpp"
#include "unirit/random.hpp"

namespace unirit {
namespace {

using Eigen::Vector3d;

constexpr int kFewestVertices = 500;

/// An ellipsoid, or one drawn along a segment while it grows or shrinks by `taper`. Millimetres; x
/// to the patient's left, y to the back, z to the head.
struct Blob {
  Vector3d from, to;
  Vector3d radii;
  double taper = 1.0;
};

/// Blobs melted together, others carved out of them; `blend` rounds every seam [mm].
struct Anatomy {
  double blend = 0.0;
  std::vector<Blob> lobes;
  std::vector<Blob> notches;
};

Blob ball(const Vector3d& centre, const Vector3d& radii) { return {centre, centre, radii}; }

const std::map<std::string, Anatomy>& anatomies() {
  static const std::map<std::string, Anatomy> table{
      {"liver",
       {8.0,
        {{{-50, 0, -12}, {-45, 5, 15}, {58, 56, 60}},       // right lobe
         {{-40, 0, 12}, {20, -8, 20}, {44, 46, 42}},        // between the lobes
         ball({46, -16, 24}, {60, 40, 25}),                 // left lobe
         ball({0, 30, 10}, {20, 20, 26})},                  // caudate lobe
        {ball({48, 22, -82}, {84, 80, 84}),                 // stomach
         ball({-42, 78, -58}, {36, 38, 52}),                // right kidney
         {{-16, -42, -56}, {-10, 4, -36}, {14, 14, 14}},    // gallbladder
         {{14, -74, -30}, {14, -66, 80}, {7, 18, 7}},       // falciform ligament
         {{-20, 36, -30}, {25, 30, -18}, {10, 10, 10}}}}},  // porta
      {"kidney",
       {5.0,
        {ball({1, 0, 27}, {25, 21, 24}),               // upper pole
         ball({3, 1, -27}, {24, 20, 25}),              // lower pole
         {{-6, 0, -16}, {-6, 0, 16}, {23, 21, 23}}},   // lateral border
        {{{32, 0, -7}, {17, -2, 7}, {13, 10, 15}}}}},  // hilum
      {"spleen",
       {5.0,
        {{{-2, 4, -28}, {-2, -4, 28}, {22, 34, 26}}},
        {ball({66, 4, 4}, {56, 62, 84}),                 // visceral face
         {{-4, -48, 13}, {8, -30, 10}, {9, 11, 5}},      // upper notch
         {{-4, -46, -13}, {8, -30, -10}, {9, 9, 4}}}}},  // lower notch
      {"gallbladder",
       {2.5,
        {{{0, 0, 0}, {0, 6, 40}, {17, 15, 17}, 0.55},  // fundus and body
         ball({5, 3, 44}, {9, 9, 9}),                  // infundibulum
         {{0, 8, 44}, {-8, 17, 58}, {8, 8, 8}, 0.8}},  // neck
        {ball({-21, 2, 16}, {8, 10, 8}),               // fold of the body
         ball({17, 16, 56}, {9, 9, 6})}}},             // bend of the neck
      {"stomach",
       {8.0,
        {ball({38, 12, 78}, {42, 36, 40}),                      // fundus
         {{36, 6, 66}, {20, -10, -18}, {42, 34, 40}, 0.8},      // body
         {{18, -12, -26}, {-52, -8, -38}, {34, 30, 32}, 0.55},  // antrum
         {{-52, -8, -38}, {-76, 0, -22}, {15, 15, 15}, 0.8},    // pylorus
         {{12, 12, 80}, {0, 16, 106}, {12, 12, 12}}},           // cardia
        {{{-28, -14, 6}, {-6, -6, 14}, {16, 34, 16}}}}}};       // angular notch
  return table;
}

/// Another patient: every measure off by some percent, the whole larger or smaller.
class Patient {
 public:
  Patient(Anatomy anatomy, std::uint64_t seed) : anatomy_(std::move(anatomy)), random_(seed) {
    const Vector3d proportions =
        random_.uniform(0.87, 1.13) * random_.uniformVector(fill(0.93), fill(1.07));
    for (auto* blobs : {&anatomy_.lobes, &anatomy_.notches}) {
      for (Blob& blob : *blobs) vary(proportions, blob);
    }
    for (const Blob& lobe : anatomy_.lobes) {
      const double largest = std::max(1.0, lobe.taper);
      for (const Vector3d& centre : {lobe.from, lobe.to}) {
        box_.extend(Vector3d(centre - largest * lobe.radii));
        box_.extend(Vector3d(centre + largest * lobe.radii));
      }
    }
    makeUneven();
  }

  /// About the distance to the surface [mm], negative inside.
  double operator()(const Vector3d& point) const {
    const double solid = blended(anatomy_.lobes, point);
    const double hollow = blended(anatomy_.notches, point);
    double distance = -softMinimum(-solid, hollow);
    for (const Wave& wave : waves_) {
      distance += wave.amplitude * std::sin(wave.direction.dot(point) + wave.phase);
    }
    return distance;
  }

  /// The whole organ with room for blends and unevenness.
  Eigen::AlignedBox3d box() const {
    const Vector3d margin = fill(4.0 * anatomy_.blend + 0.05 * box_.sizes().maxCoeff());
    return {Vector3d(box_.min() - margin), Vector3d(box_.max() + margin)};
  }

 private:
  struct Wave {
    Vector3d direction;  // times the wave number [1/mm]
    double phase = 0.0;
    double amplitude = 0.0;  // [mm]
  };

  static Vector3d fill(double value) { return Vector3d::Constant(value); }

  void vary(const Vector3d& proportions, Blob& blob) {
    const Vector3d shift = 0.07 * blob.radii.mean() * random_.uniformVector(fill(-1), fill(1));
    blob.radii = blob.radii.cwiseProduct(random_.uniformVector(fill(0.9), fill(1.1)));
    blob.from += shift;
    blob.to += shift;
    for (Vector3d* measure : {&blob.from, &blob.to, &blob.radii}) {
      *measure = measure->cwiseProduct(proportions);
    }
  }

  // Gentle long waves over the surface; no two organs bulge alike.
  void makeUneven() {
    const double size = box_.sizes().maxCoeff();
    for (int i = 0; i < 6; ++i) {
      const double length = size * random_.uniform(0.35, 0.8);
      waves_.push_back({2.0 * M_PI / length * random_.direction(), random_.uniform(0, 2 * M_PI),
                        0.006 * size * random_.uniform(0.3, 1.0)});
    }
  }

  static double distanceTo(const Blob& blob, const Vector3d& point) {
    const Vector3d axis = blob.to - blob.from;
    const double length = std::max(axis.squaredNorm(), 1e-12);
    const double t = std::clamp(axis.dot(point - blob.from) / length, 0.0, 1.0);
    const double eased = t * t * (3.0 - 2.0 * t);  // no crease where the ends set in
    const Vector3d radii = (1.0 + eased * (blob.taper - 1.0)) * blob.radii;
    const Vector3d scaled = (point - blob.from - t * axis).cwiseQuotient(radii);
    // To first order: the value over its gradient
    const double slope = scaled.cwiseQuotient(radii).norm();
    const double level = scaled.norm();
    return slope < 1e-9 ? -radii.minCoeff() : level * (level - 1.0) / slope;
  }

  double softMinimum(double a, double b) const {
    return std::min(a, b) -
           anatomy_.blend * std::log1p(std::exp(-std::abs(a - b) / anatomy_.blend));
  }

  double blended(const std::vector<Blob>& blobs, const Vector3d& point) const {
    double distance = distanceTo(blobs.front(), point);
    for (std::size_t i = 1; i < blobs.size(); ++i) {
      distance = softMinimum(distance, distanceTo(blobs[i], point));
    }
    return distance;
  }

  Anatomy anatomy_;
  Random random_;
  Eigen::AlignedBox3d box_;
  std::vector<Wave> waves_;
};

}  // namespace

const std::vector<std::string>& phantomOrgans() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> result;
    for (const auto& [name, anatomy] : anatomies()) result.push_back(name);
    return result;
  }();
  return names;
}

Surface makePhantom(const std::string& organ, std::uint64_t seed, int approximate_vertices) {
  const auto anatomy = anatomies().find(organ);
  if (anatomy == anatomies().end()) {
    throw std::invalid_argument("organ: \"" + organ + "\" is not a phantom's name");
  }
  if (approximate_vertices < kFewestVertices) {
    throw std::invalid_argument("approximate_vertices: must be at least 500");
  }
  const Patient patient(anatomy->second, seed);
  // A coarse mesh tells how many vertices a spacing gives: their number times its square is
  // constant
  const double coarse = patient.box().sizes().maxCoeff() / 24.0;
  const double vertices =
      static_cast<double>(cutOut(patient, patient.box(), coarse).vertices.size());
  const double spacing = coarse * std::sqrt(vertices / approximate_vertices);
  Surface surface = cutOut(patient, patient.box(), spacing);
  evenOut(patient, surface);

  constexpr float kMetresPerMillimetre = 0.001F;
  Points& points = surface.vertices.points;
  points = (points.colwise() - centroid(points)) * kMetresPerMillimetre;
  return surface;
}

}  // namespace unirit
