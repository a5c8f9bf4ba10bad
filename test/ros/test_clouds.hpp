// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit::test {

inline constexpr char kOrganFrame[] = "organ";
inline constexpr char kCameraFrame[] = "camera";

/// A smooth organ-like surface of 0.2 m extent, without symmetries: 3 x count [m].
Points organ(int count = 800);

/// How a message writes its points down.
struct MessageLayout {
  bool float64 = false;
  bool big_endian = false;
  std::uint32_t offset = 0;   ///< bytes before x
  std::uint32_t padding = 0;  ///< bytes after z
  std::uint32_t height = 1;   ///< rows
  std::uint32_t row_gap = 0;  ///< bytes after each row
  std::vector<std::string> fields{"x", "y", "z"};
};

/// `values`: one row a field, one column a point.
sensor_msgs::PointCloud2 message(const Eigen::MatrixXd& values, const MessageLayout& layout);

/// Points in the plainest layout, with a frame and stamp.
sensor_msgs::PointCloud2 message(const Points& points, const std::string& frame, ros::Time stamp);

}  // namespace unirit::test
