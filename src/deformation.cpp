// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/deformation.hpp"

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "neighbours.hpp"

namespace unirit {
namespace {

constexpr std::size_t kInterpolationNeighbours = 8;
constexpr float kRidge = 1e-3F;                 // over the scatter of the neighbours
constexpr std::size_t kGradientNeighbours = 9;  // of a surface point: itself and 8 more

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

  std::vector<Eigen::Matrix3f> gradients(const Points& preoperative) const override {
    std::vector<Eigen::Matrix3f> result;
    result.reserve(static_cast<std::size_t>(preoperative.cols()));
    for (Eigen::Index i = 0; i < preoperative.cols(); ++i) {
      result.push_back(gradientAt(preoperative.col(i)));
    }
    return result;
  }

  Eigen::RowVectorXf confidence(const Points&) const override { return {}; }

  float priorDeviation() const override { return 0.0F; }

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

  /// The linear map that best takes the offsets of the neighbours to their changes. The ridge
  /// stands for "no change", which is what they cannot tell about the direction across a flat
  /// patch.
  Eigen::Matrix3f gradientAt(const Eigen::Vector3f& point) const {
    const auto nearest = neighbours_.find<kGradientNeighbours>(point);
    const Eigen::Vector3f displacement = at(point);
    Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero(), products = Eigen::Matrix3f::Zero();
    for (std::size_t k = 0; k < nearest.count; ++k) {
      const auto j = static_cast<Eigen::Index>(nearest.indices[k]);
      const Eigen::Vector3f offset = surface_.col(j) - point;
      scatter += offset * offset.transpose();
      products += (displacements_.col(j) - displacement) * offset.transpose();
    }
    if (scatter.trace() == 0.0F) return Eigen::Matrix3f::Zero();
    scatter.diagonal().array() += kRidge * scatter.trace();
    return products * scatter.inverse();
  }

  Points surface_;
  Points displacements_;
  Neighbours neighbours_;
};

}  // namespace

Deformation::Deformation(const Eigen::Isometry3d& T_intraoperative_preoperative, Points surface,
                         Points displacements)
    : Deformation(T_intraoperative_preoperative, surface,
                  std::make_shared<const InterpolatedField>(surface, displacements),
                  {displacements, {}}) {}

Deformation::Deformation(const Eigen::Isometry3d& T_intraoperative_preoperative, Points surface,
                         std::shared_ptr<const DisplacementField> field, FieldValues at_surface)
    : T_intraoperative_preoperative_(T_intraoperative_preoperative),
      surface_(std::move(surface)),
      field_(std::move(field)),
      at_surface_(std::move(at_surface)) {
  if (!field_) throw std::invalid_argument("field: none was given");
  const Eigen::Index count = surface_.cols(), sure = at_surface_.confidence.size();
  if (at_surface_.displacements.cols() != count || (sure != 0 && sure != count) || count == 0) {
    throw std::invalid_argument(
        "displacements, confidence: must be as many as the surface points, at least 1");
  }
}

Points Deformation::movedSurface() const { return moveRigidly(surface_) + displacements(); }

Points Deformation::move(const Points& preoperative) const {
  return moveRigidly(preoperative) + field_->displacements(preoperative);
}

Points Deformation::moveRigidly(const Points& preoperative) const {
  return moved(T_intraoperative_preoperative_, preoperative);
}

std::vector<Eigen::Matrix3f> Deformation::jacobians(const Points& preoperative) const {
  std::vector<Eigen::Matrix3f> jacobians = field_->gradients(preoperative);
  const Eigen::Matrix3f rotation = T_intraoperative_preoperative_.linear().cast<float>();
  for (Eigen::Matrix3f& jacobian : jacobians) jacobian += rotation;
  return jacobians;
}

Eigen::RowVectorXf Deformation::confidence(const Points& preoperative) const {
  return field_->confidence(preoperative);
}

Eigen::RowVectorXf Deformation::deviations() const {
  return field_->priorDeviation() * (1.0F - confidence().array()).sqrt();
}

}  // namespace unirit
