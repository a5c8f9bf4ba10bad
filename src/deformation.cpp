// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/deformation.hpp"

#include <stdexcept>
#include <utility>

#include "neighbours.hpp"

namespace unirit {
namespace {

constexpr std::size_t kInterpolationNeighbours = 8;

}  // namespace

struct Deformation::Index : Neighbours {
  using Neighbours::Neighbours;
};

Deformation::Deformation(const Eigen::Isometry3d& T_intraoperative_preoperative, Points surface,
                         Points displacements)
    : T_intraoperative_preoperative_(T_intraoperative_preoperative),
      surface_(std::move(surface)),
      displacements_(std::move(displacements)) {
  if (surface_.cols() != displacements_.cols() || surface_.cols() == 0) {
    throw std::invalid_argument("displacements: must be as many as the surface points, at least 1");
  }
  index_ = std::make_unique<const Index>(surface_);
}

Deformation::~Deformation() = default;

Points Deformation::movedSurface() const { return moveRigidly(surface_) + displacements_; }

Points Deformation::move(const Points& preoperative) const {
  Points moved = moveRigidly(preoperative);
  for (Eigen::Index i = 0; i < preoperative.cols(); ++i) {
    const auto nearest = index_->find<kInterpolationNeighbours>(preoperative.col(i));
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float weights = 0.0F;
    for (std::size_t k = 0; k < nearest.count; ++k) {
      const Eigen::Vector3f displacement =
          displacements_.col(static_cast<Eigen::Index>(nearest.indices[k]));
      const float squared_distance = nearest.squared_distances[k];
      if (squared_distance == 0.0F) {  // a surface point, found first
        sum = displacement;
        weights = 1.0F;
        break;
      }
      const float weight = 1.0F / std::sqrt(squared_distance);
      sum += weight * displacement;
      weights += weight;
    }
    moved.col(i) += sum / weights;
  }
  return moved;
}

Points Deformation::moveRigidly(const Points& preoperative) const {
  return (T_intraoperative_preoperative_ * preoperative.cast<double>()).cast<float>();
}

}  // namespace unirit
