// SPDX-License-Identifier: BSD-3-Clause
#include "visibility.hpp"

#include <algorithm>

#include "unirit/sampling.hpp"

namespace unirit {
namespace {

constexpr float kGrazingCosine = 0.1F;  // surely facing from kGrazingCosine + kGrazingRange on
constexpr float kGrazingRange = 0.3F;
constexpr int kHiders = 256;
constexpr float kHiderRadius = 0.2F;   // a hider reaches so far across a ray, as hiders lie apart
constexpr float kHidingHeight = 0.1F;  // surely hidden by what stands so high above

/// x, y, z and how surely it faces the eye. What faces away need not count: a front before it hides
/// as much.
using Hiders = Eigen::Array<float, Eigen::Dynamic, 4, Eigen::ColMajor, kHiders, 4>;

/// How surely some hider stands between an oriented point and the eye: near the ray, not beyond the
/// eye, which may stand in a hollow, and above the tangent plane, for what is nearer on the same
/// slope is in nobody's way.
float hidden(const Hiders& hiders, const Eigen::Vector3f& point, const Eigen::Vector3f& normal,
             const Eigen::Vector3f& eye) {
  if (hiders.rows() == 0) return 0.0F;
  const float distance = (eye - point).norm();
  const Eigen::Vector3f ray = (eye - point) / distance;
  const auto x = hiders.col(0) - point.x(), y = hiders.col(1) - point.y(),
             z = hiders.col(2) - point.z();
  const auto height = x * normal.x() + y * normal.y() + z * normal.z();
  const auto along = x * ray.x() + y * ray.y() + z * ray.z();
  const auto squared_away = x.square() + y.square() + z.square() - along.square();
  const auto near = 2.0F - squared_away * (2.0F / (kHiderRadius * kHiderRadius));
  const auto before = (distance - along) * (1.0F / kHiderRadius);
  return (hiders.col(3) * near.max(0.0F).min(1.0F) * before.max(0.0F).min(1.0F) *
          (height * (1.0F / kHidingHeight)).max(0.0F).min(1.0F))
      .maxCoeff();
}

}  // namespace

Visibility::Visibility(const Points& surface) : hiders_(sampleEvenly(surface, kHiders)) {}

Eigen::RowVectorXf Visibility::of(const PointCloud& moved,
                                  const std::optional<Eigen::Vector3f>& eye) const {
  Eigen::RowVectorXf visibility;
  update(moved, eye, visibility);
  return visibility;
}

void Visibility::update(const PointCloud& moved, const std::optional<Eigen::Vector3f>& eye,
                        Eigen::RowVectorXf& visibility) const {
  visibility.setOnes(moved.size());
  if (!eye) return;
  for (Eigen::Index i = 0; i < moved.size(); ++i) {
    const float cosine = moved.normals.col(i).dot((*eye - moved.points.col(i)).normalized());
    visibility[i] = std::clamp((cosine - kGrazingCosine) / kGrazingRange, 0.0F, 1.0F);
  }
  Hiders hiders(kHiders, 4);
  Eigen::Index count = 0;
  for (const Eigen::Index i : hiders_) {
    if (visibility[i] == 0.0F) continue;
    hiders.row(count++) << moved.points.col(i).transpose().array(), visibility[i];
  }
  hiders.conservativeResize(count, 4);
  for (Eigen::Index i = 0; i < moved.size(); ++i) {
    if (visibility[i] == 0.0F) continue;
    visibility[i] *= 1.0F - hidden(hiders, moved.points.col(i), moved.normals.col(i), *eye);
  }
}

}  // namespace unirit
