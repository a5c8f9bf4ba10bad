// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/preprocessing.hpp"

#include <pcl/filters/crop_box.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "preprocessing/voxel_grid.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

using Columns = std::vector<Eigen::Index>;

Region regionAround(const Points& organ, const Eigen::Isometry3d& T_cloud_organ, double border) {
  const Eigen::Vector3d lowest = organ.rowwise().minCoeff().cast<double>();
  const Eigen::Vector3d highest = organ.rowwise().maxCoeff().cast<double>();
  return {{lowest.array() - border, highest.array() + border}, T_cloud_organ.inverse()};
}

Columns insideOf(const Points& points, const Region& region) {
  const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  cloud->resize(static_cast<std::size_t>(points.cols()));
  cloud->getMatrixXfMap(3, 4, 0) = points;
  pcl::CropBox<pcl::PointXYZ> crop;
  crop.setInputCloud(cloud);
  crop.setTransform(Eigen::Affine3f(region.T_box_cloud.cast<float>()));
  crop.setMin(region.box.min().cast<float>().homogeneous());
  crop.setMax(region.box.max().cast<float>().homogeneous());
  std::vector<int> inside;
  crop.filter(inside);
  return {inside.begin(), inside.end()};
}

/// Without the points where the sensor itself stood: drivers put there what they did not measure.
Columns awayFrom(const Eigen::Vector3f& viewpoint, const Points& points) {
  Columns columns;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (points.col(i) != viewpoint) columns.push_back(i);
  }
  return columns;
}

/// The coarsest grid, from this edge on by halves, of as many voxels as points are wanted. None
/// where the cloud has no more points than that, or says little more often.
std::optional<VoxelGrid> gridOf(const Points& points, double edge, Eigen::Index wanted) {
  constexpr int kHalvings = 8;
  if (points.cols() <= wanted) return std::nullopt;
  for (int i = 0; i <= kHalvings && VoxelGrid::resolves(points, edge); ++i, edge /= 2.0) {
    VoxelGrid grid(points, edge);
    if (grid.voxels() >= wanted) return grid;
  }
  return std::nullopt;
}

/// A cloud, and the account of what becomes of its points.
class Stages {
 public:
  Stages(RawCloud& raw, int min_points)
      : result_{std::move(raw.cloud), {{"received", raw.received}}, {}}, min_points_(min_points) {
    if (const auto& viewpoint = result_.cloud.viewpoint) keep(awayFrom(*viewpoint, points()));
    note("valid", size());
  }

  const Points& points() const { return result_.cloud.points; }
  bool failed() const { return result_.fault.has_value(); }
  Preprocessed result() { return std::move(result_); }

  void crop(const std::string& stage, const Region& region) {
    const Eigen::Index before = size();
    keep(insideOf(points(), region));
    note(stage, size());
    if (before < min_points_ || size() >= min_points_) return;
    std::ostringstream sentence;
    sentence << "preprocessing/" << stage << " leaves " << size() << " of " << before
             << " points of the intra-operative cloud, at least " << min_points_ << " are needed";
    result_.fault = sentence.str();
  }

  void thin(double edge, double min_density, Eigen::Index wanted) {
    std::optional<VoxelGrid> grid = gridOf(points(), edge, wanted);
    if (min_density > 0.0) {
      if (grid) grid->dropSparse(min_density);
      note("outliers", grid ? grid->points() : size());
    }
    if (grid) take(grid->representatives());
    note("voxel", size());
  }

 private:
  Eigen::Index size() const { return result_.cloud.size(); }

  void note(const std::string& stage, Eigen::Index left) {
    result_.stages.push_back({stage, left});
  }

  void keep(const Columns& columns) {
    if (static_cast<Eigen::Index>(columns.size()) < size()) take(columns);
  }

  void take(const Columns& columns) {
    PointCloud& cloud = result_.cloud;
    cloud.points = select(cloud.points, columns);
    if (cloud.normals.cols() > 0) cloud.normals = select(cloud.normals, columns);
  }

  Preprocessed result_;
  int min_points_;
};

}  // namespace

Preprocessed preprocess(RawCloud raw, const Points& organ, const RegistrationSettings& settings) {
  validate(settings);
  const PlausibilitySettings& limits = settings.plausibility;
  const PreprocessingSettings& wanted = settings.preprocessing;
  Stages stages(raw, limits.min_points);
  const double size = organ.cols() > 0 ? extent(organ) : 0.0;
  if (stages.points().cols() == 0 || size < limits.min_organ_extent ||
      size > limits.max_organ_extent) {
    return stages.result();
  }
  if (raw.region) stages.crop("region", *raw.region);
  if (wanted.margin > 0.0 && raw.T_cloud_organ && !stages.failed()) {
    stages.crop("margin", regionAround(organ, *raw.T_cloud_organ, wanted.margin * size));
  }
  if (!stages.failed() && wanted.voxel > 0.0 &&
      settings.refinement.correspondence == Correspondence::kSurface) {
    stages.thin(wanted.voxel * size, wanted.min_density,
                std::max(settings.sampling.points, limits.min_points));
  }
  return stages.result();
}

}  // namespace unirit
