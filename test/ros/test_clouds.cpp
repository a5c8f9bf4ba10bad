// SPDX-License-Identifier: BSD-3-Clause
#include "test_clouds.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace unirit::test {
namespace {

template <class Number>
void write(Number value, bool big_endian, std::uint8_t* at) {
  std::uint8_t bytes[sizeof(Number)];
  std::memcpy(bytes, &value, sizeof(Number));
  if (big_endian) std::reverse(bytes, bytes + sizeof(Number));  // tests run on little-endian hosts
  std::copy(bytes, bytes + sizeof(Number), at);
}

}  // namespace

Points organ(int count) {
  Points points(3, count);
  const double golden_angle = M_PI * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / count;
    const double radius = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(radius * std::cos(golden_angle * i),
                                    radius * std::sin(golden_angle * i), z);
    const double lobes = 1.0 + 0.3 * direction.x() + 0.15 * std::sin(3.0 * direction.y() + 1.0) -
                         0.1 * direction.z() * direction.x();
    const Eigen::Vector3d axes(0.08, 0.05, 0.035);
    points.col(i) = (lobes * direction.cwiseProduct(axes)).cast<float>();
  }
  return points;
}

sensor_msgs::PointCloud2 message(const Eigen::MatrixXd& values, const MessageLayout& layout) {
  const std::uint32_t size = layout.float64 ? 8 : 4;
  sensor_msgs::PointCloud2 made;
  made.header.frame_id = "frame";
  for (std::size_t i = 0; i < layout.fields.size(); ++i) {
    sensor_msgs::PointField field;
    field.name = layout.fields[i];
    field.offset = layout.offset + static_cast<std::uint32_t>(i) * size;
    field.datatype =
        layout.float64 ? sensor_msgs::PointField::FLOAT64 : sensor_msgs::PointField::FLOAT32;
    field.count = 1;
    made.fields.push_back(field);
  }
  made.height = layout.height;
  made.width = static_cast<std::uint32_t>(values.cols()) / layout.height;
  made.point_step =
      layout.offset + static_cast<std::uint32_t>(values.rows()) * size + layout.padding;
  made.row_step = made.width * made.point_step + layout.row_gap;
  made.is_bigendian = layout.big_endian;
  made.data.assign(std::size_t{made.row_step} * made.height, 0xAB);
  for (Eigen::Index i = 0; i < values.cols(); ++i) {
    std::uint8_t* point = made.data.data() + i / made.width * made.row_step +
                          i % made.width * made.point_step + layout.offset;
    for (Eigen::Index k = 0; k < values.rows(); ++k) {
      if (layout.float64)
        write(values(k, i), layout.big_endian, point + k * size);
      else
        write(static_cast<float>(values(k, i)), layout.big_endian, point + k * size);
    }
  }
  return made;
}

sensor_msgs::PointCloud2 message(const Points& points, const std::string& frame, ros::Time stamp) {
  sensor_msgs::PointCloud2 made = message(points.cast<double>(), MessageLayout());
  made.header.frame_id = frame;
  made.header.stamp = stamp;
  return made;
}

}  // namespace unirit::test
