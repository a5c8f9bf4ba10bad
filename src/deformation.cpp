// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/deformation.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "neighbours.hpp"

namespace unirit {
namespace {

constexpr std::size_t kInterpolationNeighbours = 8;

/// Displacements known at the surface's points; in between the inverse-distance mean of the
/// nearest (Shepard 1968).
class InterpolatedField : public DisplacementField {
 public:
  InterpolatedField(Points surface, Points displacements)
      : surface_(std::move(surface)),
        displacements_(std::move(displacements)),
        neighbours_(surface_) {}

  Points displacements(const Points& preoperative) const override {
    Points result(3, preoperative.cols());
    for (Eigen::Index i = 0; i < preoperative.cols(); ++i) result.col(i) = at(preoperative.col(i));
    return result;
  }

  Eigen::RowVectorXf confidence(const Points&) const override { return {}; }

 private:
  Eigen::Vector3f at(const Eigen::Vector3f& point) const {
    const auto nearest = neighbours_.find<kInterpolationNeighbours>(point);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float weights = 0.0F;
    for (std::size_t k = 0; k < nearest.count; ++k) {
      const auto displacement = displacements_.col(static_cast<Eigen::Index>(nearest.indices[k]));
      const float squared_distance = nearest.squared_distances[k];
      if (squared_distance == 0.0F) return displacement;  // a surface point, found first
      const float weight = 1.0F / std::sqrt(squared_distance);
      sum += weight * displacement;
      weights += weight;
    }
    return sum / weights;
  }

  Points surface_;
  Points displacements_;
  Neighbours neighbours_;
};

}  // namespace

Deformation::Deformation(const Eigen::Isometry3d& T_intraoperative_preoperative, Points surface,
                         Points displacements)
    : T_intraoperative_preoperative_(T_intraoperative_preoperative),
      surface_(std::move(surface)),
      displacements_(std::move(displacements)) {
  if (surface_.cols() != displacements_.cols() || surface_.cols() == 0) {
    throw std::invalid_argument("displacements: must be as many as the surface points, at least 1");
  }
  field_ = std::make_shared<const InterpolatedField>(surface_, displacements_);
}

Deformation::Deformation(const Eigen::Isometry3d& T_intraoperative_preoperative, Points surface,
                         std::shared_ptr<const DisplacementField> field)
    : T_intraoperative_preoperative_(T_intraoperative_preoperative),
      surface_(std::move(surface)),
      field_(std::move(field)) {
  if (!field_) throw std::invalid_argument("field: none was given");
  displacements_ = field_->displacements(surface_);
}

Points Deformation::movedSurface() const { return moveRigidly(surface_) + displacements_; }

Points Deformation::move(const Points& preoperative) const {
  return moveRigidly(preoperative) + field_->displacements(preoperative);
}

Points Deformation::moveRigidly(const Points& preoperative) const {
  return moved(T_intraoperative_preoperative_, preoperative);
}

Eigen::RowVectorXf Deformation::confidence(const Points& preoperative) const {
  return field_->confidence(preoperative);
}

}  // namespace unirit
