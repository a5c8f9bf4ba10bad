// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <nanoflann.hpp>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// k-d tree over points that must outlive it. Queries are const and may run on several threads.
class Neighbours {
 public:
  explicit Neighbours(const Points& points) : points_{points}, tree_(3, points_, {kLeafSize}) {
    tree_.buildIndex();
  }
  Neighbours(const Neighbours&) = delete;
  Neighbours& operator=(const Neighbours&) = delete;

  template <std::size_t K>
  struct Nearest {
    std::array<std::size_t, K> indices{};
    std::array<float, K> squared_distances{};
    std::size_t count = 0;  ///< less than K where the tree holds fewer points
  };

  template <std::size_t K>
  Nearest<K> find(const Eigen::Vector3f& query) const {
    Nearest<K> nearest;
    nearest.count =
        tree_.knnSearch(query.data(), K, nearest.indices.data(), nearest.squared_distances.data());
    return nearest;
  }

 private:
  /// What nanoflann asks of a point container.
  struct Columns {
    const Points& points;
    std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(points.cols()); }
    float kdtree_get_pt(std::size_t column, std::size_t axis) const {
      return points(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(column));
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
      return false;  // none at hand, nanoflann computes it
    }
  };
  static constexpr std::size_t kLeafSize = 16;

  Columns points_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Columns>, Columns, 3,
                                      std::size_t>
      tree_;
};

/// So many points are a sample's neighbourhood on a surface, itself among them.
inline constexpr Eigen::Index kSurfaceNeighbours = 14;

/// Column i: the points nearest to point i, itself among them, the farthest last; as many as there
/// are where that is less than kSurfaceNeighbours.
Eigen::MatrixXi nearestPoints(const Points& points);

/// As in unirit/normals.hpp, from what nearestPoints found.
Points estimateNormals(const Points& points, const Eigen::MatrixXi& nearest);
void orientOutwards(const Points& points, const Eigen::MatrixXi& nearest, Points& normals);

}  // namespace unirit
