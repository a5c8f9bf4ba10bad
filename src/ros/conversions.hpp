// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// A cloud as read from a message: the finite points, and which of the message's they were.
struct ReceivedCloud {
  PointCloud cloud;                ///< finite points [m]; normals only where every point has one
  std::vector<Eigen::Index> kept;  ///< column i of the cloud is point kept[i] of the message
  Eigen::Index total = 0;          ///< points in the message

  Eigen::Index dropped() const { return total - cloud.size(); }
};

/// Reads x y z, and normal_x normal_y normal_z where present: FLOAT32 or FLOAT64, either byte
/// order, at any offset. Points that are not finite in single precision are dropped. Throws Refusal
/// (INVALID_INPUT) with a sentence that begins with `name` where sizes, fields or types are wrong.
ReceivedCloud fromMessage(const sensor_msgs::PointCloud2& message, const std::string& name);

/// A number of each point beside its place.
struct PointValues {
  const char* field;          ///< its name in the message
  Eigen::RowVectorXf values;  ///< one a point; a field without any is left out
};

/// Message with x y z [m] and the values for all `source.total` points, in their order; dropped
/// ones are NaN.
sensor_msgs::PointCloud2 toMessage(const Points& points, const std::vector<PointValues>& values,
                                   const ReceivedCloud& source, const std_msgs::Header& header);

/// Message with x y z [m] for the points, in their order, and normal_x normal_y normal_z where the
/// cloud has them.
sensor_msgs::PointCloud2 toMessage(const PointCloud& cloud, const std_msgs::Header& header);
sensor_msgs::PointCloud2 toMessage(const Points& points, const std_msgs::Header& header);

/// A cloud of no points: takes the place of one that no longer holds.
sensor_msgs::PointCloud2 emptyCloud(const std_msgs::Header& header);

}  // namespace unirit
