// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/simulation/organ_motion.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "unirit/random.hpp"

namespace unirit {
namespace {

constexpr double kBulgePeriod = 31.0;     // [s]
constexpr double kRotationPeriod = 41.0;  // [s]
constexpr double kShiftPeriod = 53.0;     // [s]
constexpr double kBulgeWidth = 0.25;      // standard deviation over the extent

// Rises from 0 to 1 and falls back once a period.
double swell(double t, double period) { return 0.5 * (1.0 - std::cos(2.0 * M_PI * t / period)); }

// Swings between -1 and 1 once a period, from 0.
double swing(double t, double period) { return std::sin(2.0 * M_PI * t / period); }

void validate(const MotionSettings& settings) {
  const std::pair<const char*, double> values[] = {
      {"breathing_amplitude", settings.breathing_amplitude},
      {"bulge_amplitude", settings.bulge_amplitude},
      {"deformation", settings.deformation},
      {"rigid_rotation", settings.rigid_rotation},
      {"rigid_translation", settings.rigid_translation}};
  for (const auto& [name, value] : values) {
    if (!(value >= 0.0 && std::isfinite(value))) {
      throw std::invalid_argument(std::string(name) + ": must not be negative");
    }
  }
  if (!(settings.breathing_period > 0.0 && std::isfinite(settings.breathing_period))) {
    throw std::invalid_argument("breathing_period: must be positive");
  }
}

}  // namespace

OrganMotion::OrganMotion(const Points& organ, const MotionSettings& settings, std::uint64_t seed)
    : settings_(settings) {
  validate(settings);
  extent_ = extent(organ);
  centre_ = centroid(organ);
  Random random(seed);
  spline_ = randomDeformation(organ, settings.deformation * extent_, random.next());
  rotation_axis_ = random.direction().cast<float>();
  shift_direction_ = random.direction().cast<float>();
  Eigen::Index top = 0;
  (random.direction().cast<float>().transpose() * organ).maxCoeff(&top);
  bulge_top_ = organ.col(top);
}

Points OrganMotion::at(const Points& preoperative, double t) const {
  const double breath = swell(t, settings_.breathing_period);
  Points points =
      preoperative + static_cast<float>(0.5 + 0.5 * breath) * spline_.displacements(preoperative);

  const double height = settings_.bulge_amplitude * extent_ * swell(t, kBulgePeriod);
  const Eigen::Vector3f outwards = (bulge_top_ - centre_).normalized();
  const double width = kBulgeWidth * extent_;
  const Eigen::RowVectorXf distances = (preoperative.colwise() - bulge_top_).colwise().norm();
  const Eigen::RowVectorXf bulge =
      height * (-0.5 * (distances.array().cast<double>() / width).square()).exp().cast<float>();
  points += outwards * bulge;

  const double angle = settings_.rigid_rotation * M_PI / 180.0 * swing(t, kRotationPeriod);
  const Eigen::Matrix3f rotation =
      Eigen::AngleAxisf(static_cast<float>(angle), rotation_axis_).toRotationMatrix();
  const double shift = settings_.rigid_translation * extent_ * swing(t, kShiftPeriod);
  const double sinking = settings_.breathing_amplitude * extent_ * breath;
  const Eigen::Vector3f moved_centre = centre_ + static_cast<float>(shift) * shift_direction_ -
                                       static_cast<float>(sinking) * Eigen::Vector3f::UnitZ();
  return (rotation * (points.colwise() - centre_)).colwise() + moved_centre;
}

}  // namespace unirit
