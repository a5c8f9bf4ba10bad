// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/depth_camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "unirit/random.hpp"

namespace unirit {
namespace {

using Eigen::Vector3d;

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr int kMostPixels = 1 << 14;  // along either side

void require(bool condition, const char* sentence) {
  if (!condition) throw std::invalid_argument(sentence);
}

void validate(const Surface& mesh, const Eigen::Isometry3d& T_camera_mesh,
              const DepthCamera& camera) {
  require(mesh.faces.cols() > 0, "mesh: has no faces");
  require(mesh.faces.minCoeff() >= 0 && mesh.faces.maxCoeff() < mesh.vertices.size(),
          "mesh: a face refers to a vertex that does not exist");
  require(mesh.vertices.points.allFinite(), "mesh: a vertex is not finite");
  require(T_camera_mesh.matrix().allFinite(), "T_camera_mesh: is not finite");
  require(camera.width >= 1 && camera.width <= kMostPixels && camera.height >= 1 &&
              camera.height <= kMostPixels,
          "camera: width and height must be 1 to 16384 pixels");
  require(camera.horizontal_field > 0.0 && camera.horizontal_field < 180.0,
          "camera: horizontal_field must lie between 0 and 180 degrees");
  require(camera.min_range >= 0.0 && camera.min_range < camera.max_range,
          "camera: min_range must be less than max_range and not negative");
  require(camera.depth_noise >= 0.0 && std::isfinite(camera.depth_noise),
          "camera: depth_noise must not be negative");
  require(camera.outlier_fraction >= 0.0 && camera.outlier_fraction <= 1.0,
          "camera: outlier_fraction must lie between 0 and 1");
}

/// Depth (z) of what each pixel's ray meets first.
class DepthImage {
 public:
  explicit DepthImage(const DepthCamera& camera)
      : width_(camera.width),
        height_(camera.height),
        focal_length_(0.5 * camera.width / std::tan(camera.horizontal_field * M_PI / 360.0)),
        depths_(static_cast<std::size_t>(camera.width) * camera.height, kNothing) {}

  /// A point at depth 1 on the ray through the middle of pixel (u, v).
  Vector3d ray(int u, int v) const {
    return {(u + 0.5 - 0.5 * width_) / focal_length_, (v + 0.5 - 0.5 * height_) / focal_length_,
            1.0};
  }

  double& depth(int u, int v) { return depths_[static_cast<std::size_t>(v) * width_ + u]; }

  void draw(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
    const Eigen::AlignedBox2i pixels = pixelsAround(a, b, c);
    // Planes through the eye and the edges: a ray between all three meets the triangle
    Eigen::Matrix3d edges;
    edges << b.cross(c).transpose(), c.cross(a).transpose(), a.cross(b).transpose();
    const double volume = a.dot(b.cross(c));
    for (int v = pixels.min()[1]; v <= pixels.max()[1]; ++v) {
      for (int u = pixels.min()[0]; u <= pixels.max()[0]; ++u) {
        const Vector3d sides = edges * ray(u, v);
        if (sides.minCoeff() < 0.0 && sides.maxCoeff() > 0.0) continue;
        const double met = volume / sides.sum();
        if (met > 0.0 && met < depth(u, v)) depth(u, v) = met;
      }
    }
  }

 private:
  // All pixels where the triangle reaches behind the camera, for then its corners do not bound it.
  Eigen::AlignedBox2i pixelsAround(const Vector3d& a, const Vector3d& b, const Vector3d& c) const {
    constexpr double kBehind = 1e-6;
    const Eigen::AlignedBox2i image(Eigen::Vector2i(0, 0),
                                    Eigen::Vector2i(width_ - 1, height_ - 1));
    const double nearest = std::min({a[2], b[2], c[2]});
    if (nearest < kBehind) {
      return std::max({a[2], b[2], c[2]}) < kBehind ? Eigen::AlignedBox2i() : image;
    }
    Eigen::AlignedBox2d box;
    for (const Vector3d& corner : {a, b, c}) {
      box.extend(Eigen::Vector2d(focal_length_ * corner.head<2>() / corner[2]));
    }
    const Eigen::Array2d middle(0.5 * width_ - 0.5, 0.5 * height_ - 0.5);
    const Eigen::Array2d limit(kMostPixels, kMostPixels);
    const Eigen::Array2d low = (box.min().array() + middle).ceil().max(-limit).min(limit);
    const Eigen::Array2d high = (box.max().array() + middle).floor().max(-limit).min(limit);
    return Eigen::AlignedBox2i(low.cast<int>().matrix(), high.cast<int>().matrix())
        .intersection(image);
  }

  int width_, height_;
  double focal_length_;  // [pixel]
  std::vector<double> depths_;
};

/// The points at these depths along their rays, with the sensor's errors.
Points measure(const std::vector<Vector3d>& seen, const DepthCamera& camera, std::uint64_t seed) {
  double nearest = kNothing, farthest = 0.0;
  for (const Vector3d& point : seen) {
    nearest = std::min(nearest, point[2]);
    farthest = std::max(farthest, point[2]);
  }
  const double margin = 0.25 * (farthest - nearest);
  const double low = std::max(nearest - margin, camera.min_range);
  const double high = std::min(farthest + margin, camera.max_range);

  Random random(seed);
  Points points(3, static_cast<Eigen::Index>(seen.size()));
  for (std::size_t i = 0; i < seen.size(); ++i) {
    Vector3d point = seen[i];
    if (random.uniform() < camera.outlier_fraction) {
      point *= random.uniform(low, high) / point[2];
    } else {
      point += camera.depth_noise * random.normal() * point.normalized();
    }
    points.col(static_cast<Eigen::Index>(i)) = point.cast<float>();
  }
  return points;
}

}  // namespace

PointCloud renderDepth(const Surface& mesh, const Eigen::Isometry3d& T_camera_mesh,
                       const DepthCamera& camera, std::uint64_t seed) {
  validate(mesh, T_camera_mesh, camera);
  const Eigen::Matrix3Xd vertices = T_camera_mesh * mesh.vertices.points.cast<double>();
  DepthImage image(camera);
  for (Eigen::Index i = 0; i < mesh.faces.cols(); ++i) {
    const Eigen::Vector3i face = mesh.faces.col(i);
    image.draw(vertices.col(face[0]), vertices.col(face[1]), vertices.col(face[2]));
  }
  std::vector<Vector3d> seen;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double depth = image.depth(u, v);
      if (depth >= camera.min_range && depth <= camera.max_range && depth < kNothing) {
        seen.push_back(depth * image.ray(u, v));
      }
    }
  }
  return {measure(seen, camera, seed), {}};
}

Eigen::Isometry3d lookAt(const Vector3d& eye, const Vector3d& centre, const Vector3d& up) {
  const Vector3d forward = (centre - eye).normalized();
  const Vector3d right = forward.cross(up);
  require(right.norm() > 1e-6 * up.norm() && right.allFinite(),
          "lookAt: eye and centre must differ, and up must not point along the view");
  Eigen::Isometry3d T_world_camera = Eigen::Isometry3d::Identity();
  T_world_camera.linear().col(0) = right.normalized();
  T_world_camera.linear().col(1) = forward.cross(right).normalized();
  T_world_camera.linear().col(2) = forward;
  T_world_camera.translation() = eye;
  return T_world_camera;
}

}  // namespace unirit
