// SPDX-License-Identifier: BSD-3-Clause
#include "conversions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <optional>
#include <sstream>

#include "refusal.hpp"

namespace unirit {
namespace {

using sensor_msgs::PointCloud2;
using sensor_msgs::PointField;

[[noreturn]] void refuse(const std::string& name, const std::string& fault) {
  throw Refusal(Status::kInvalidInput, name + " " + fault);
}

/// Where in a point's bytes a number stands, and how it is written.
struct NumberLayout {
  std::size_t offset = 0;
  bool is_double = false;
  bool swapped = false;  // the message's byte order is not this machine's

  double read(const std::uint8_t* point) const {
    return is_double ? as<double>(point) : static_cast<double>(as<float>(point));
  }

 private:
  template <class Number>
  Number as(const std::uint8_t* point) const {
    std::array<std::uint8_t, sizeof(Number)> bytes;
    std::copy_n(point + offset, bytes.size(), bytes.begin());
    if (swapped) std::reverse(bytes.begin(), bytes.end());
    Number number;
    std::memcpy(&number, bytes.data(), sizeof(Number));
    return number;
  }
};

using VectorLayout = std::array<NumberLayout, 3>;

Eigen::Vector3f readVector(const VectorLayout& layout, const std::uint8_t* point) {
  // A double beyond single precision becomes infinite here, and its point is dropped
  return {static_cast<float>(layout[0].read(point)), static_cast<float>(layout[1].read(point)),
          static_cast<float>(layout[2].read(point))};
}

bool hostIsBigEndian() {
  const std::uint16_t one = 1;
  std::uint8_t first = 0;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

NumberLayout layoutOf(const PointField& field, const PointCloud2& message,
                      const std::string& name) {
  std::ostringstream fault;
  if (field.datatype != PointField::FLOAT32 && field.datatype != PointField::FLOAT64) {
    fault << "has field '" << field.name << "' of type " << int{field.datatype}
          << ", neither FLOAT32 nor FLOAT64";
    refuse(name, fault.str());
  }
  if (field.count != 1) {
    fault << "has field '" << field.name << "' with count " << field.count << " instead of 1";
    refuse(name, fault.str());
  }
  const bool is_double = field.datatype == PointField::FLOAT64;
  const std::uint64_t end = std::uint64_t{field.offset} + (is_double ? 8 : 4);
  if (end > message.point_step) {
    fault << "has field '" << field.name << "' ending at byte " << end
          << " of a point, beyond its point_step of " << message.point_step;
    refuse(name, fault.str());
  }
  return {field.offset, is_double, (message.is_bigendian != 0) != hostIsBigEndian()};
}

/// The three fields' layout, or nothing where any of them is absent.
std::optional<VectorLayout> findVector(const std::array<std::string, 3>& fields,
                                       const PointCloud2& message, const std::string& name) {
  VectorLayout layout;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto field = std::find_if(message.fields.begin(), message.fields.end(),
                                    [&](const PointField& f) { return f.name == fields[i]; });
    if (field == message.fields.end()) return std::nullopt;
    layout[i] = layoutOf(*field, message, name);
  }
  return layout;
}

/// In 64 bits no product of two 32-bit numbers overflows; a third factor never comes in.
void checkSizes(const PointCloud2& message, const std::string& name) {
  std::ostringstream fault;
  const std::uint64_t row = std::uint64_t{message.width} * message.point_step;
  if (row > message.row_step) {
    fault << "has a row_step of " << message.row_step << " bytes, too few for " << message.width
          << " points of " << message.point_step;
    refuse(name, fault.str());
  }
  const std::uint64_t expected = std::uint64_t{message.row_step} * message.height;
  if (message.data.size() != expected) {
    fault << "holds " << message.data.size() << " bytes of data, but its width, height and steps "
          << "call for " << expected;
    refuse(name, fault.str());
  }
}

PointField floatField(const char* name, std::uint32_t index) {
  PointField field;
  field.name = name;
  field.offset = index * sizeof(float);
  field.datatype = PointField::FLOAT32;
  field.count = 1;
  return field;
}

}  // namespace

ReceivedCloud fromMessage(const PointCloud2& message, const std::string& name) {
  ReceivedCloud received;
  if (message.width == 0 || message.height == 0) return received;
  checkSizes(message, name);
  const auto position = findVector({"x", "y", "z"}, message, name);
  if (!position) refuse(name, "lacks one of the fields x, y, z");
  const auto normal = findVector({"normal_x", "normal_y", "normal_z"}, message, name);

  received.total = Eigen::Index{message.width} * message.height;
  PointCloud& cloud = received.cloud;
  cloud.points.resize(3, received.total);
  if (normal) cloud.normals.resize(3, received.total);
  received.kept.reserve(static_cast<std::size_t>(received.total));
  for (Eigen::Index i = 0; i < received.total; ++i) {
    const std::uint8_t* point = message.data.data() + (i / message.width) * message.row_step +
                                (i % message.width) * message.point_step;
    const Eigen::Vector3f at = readVector(*position, point);
    if (!at.allFinite()) continue;
    const auto column = static_cast<Eigen::Index>(received.kept.size());
    cloud.points.col(column) = at;
    if (normal) cloud.normals.col(column) = readVector(*normal, point).normalized();
    received.kept.push_back(i);
  }
  const auto kept = static_cast<Eigen::Index>(received.kept.size());
  cloud.points.conservativeResize(3, kept);
  if (normal) cloud.normals.conservativeResize(3, kept);
  if ((cloud.normals.colwise().norm().array() < 0.5F).any() || !cloud.normals.allFinite()) {
    cloud.normals.resize(3, 0);
  }
  return received;
}

PointCloud2 toMessage(const Points& points, const std::vector<PointValues>& values,
                      const ReceivedCloud& source, const std_msgs::Header& header) {
  PointCloud2 message;
  message.header = header;
  message.height = 1;
  message.width = static_cast<std::uint32_t>(source.total);
  message.fields = {floatField("x", 0), floatField("y", 1), floatField("z", 2)};
  std::vector<const PointValues*> known;
  for (const PointValues& value : values) {
    if (value.values.size() == 0) continue;
    message.fields.push_back(
        floatField(value.field, static_cast<std::uint32_t>(message.fields.size())));
    known.push_back(&value);
  }
  const auto numbers = static_cast<Eigen::Index>(message.fields.size());
  message.point_step = static_cast<std::uint32_t>(numbers) * sizeof(float);
  message.row_step = message.width * message.point_step;
  message.is_bigendian = hostIsBigEndian();
  message.is_dense = source.dropped() == 0;

  Eigen::MatrixXf rows =
      Eigen::MatrixXf::Constant(numbers, source.total, std::numeric_limits<float>::quiet_NaN());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    auto row = rows.col(source.kept[static_cast<std::size_t>(i)]);
    row.head<3>() = points.col(i);
    for (std::size_t k = 0; k < known.size(); ++k) {
      row[3 + static_cast<Eigen::Index>(k)] = known[k]->values[i];
    }
  }
  message.data.resize(static_cast<std::size_t>(rows.size()) * sizeof(float));
  std::memcpy(message.data.data(), rows.data(), message.data.size());
  return message;
}

PointCloud2 toMessage(const PointCloud& cloud, const std_msgs::Header& header) {
  ReceivedCloud all;
  all.total = cloud.size();
  all.kept.resize(static_cast<std::size_t>(cloud.size()));
  std::iota(all.kept.begin(), all.kept.end(), 0);
  std::vector<PointValues> normals;
  if (cloud.normals.cols() > 0) {
    normals = {{"normal_x", cloud.normals.row(0)},
               {"normal_y", cloud.normals.row(1)},
               {"normal_z", cloud.normals.row(2)}};
  }
  return toMessage(cloud.points, normals, all, header);
}

PointCloud2 toMessage(const Points& points, const std_msgs::Header& header) {
  return toMessage(PointCloud{points, {}}, header);
}

PointCloud2 emptyCloud(const std_msgs::Header& header) { return toMessage(Points(3, 0), header); }

}  // namespace unirit
