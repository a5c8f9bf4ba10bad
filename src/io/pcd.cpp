// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/io/lzf.h>

#include <limits>
#include <stdexcept>

#include "raw_surface.hpp"
#include "scalar_stream.hpp"

namespace unirit {
namespace {

struct Field {
  std::string name;
  ScalarType type = ScalarType::kFloat32;
  std::size_t count = 1;

  std::size_t bytes() const { return count * sizeOf(type); }
};

struct Header {
  std::vector<Field> fields;
  std::size_t points = 0;
  std::optional<Eigen::Vector3d> viewpoint;
  std::string data;  // ascii, binary or binary_compressed

  std::size_t pointBytes() const {
    std::size_t bytes = 0;
    for (const Field& field : fields) bytes += field.bytes();
    return bytes;
  }
};

ScalarType scalarType(std::string_view kind, long long size) {
  static constexpr ScalarType kSigned[] = {ScalarType::kInt8, ScalarType::kInt16,
                                           ScalarType::kInt32, ScalarType::kInt64};
  static constexpr ScalarType kUnsigned[] = {ScalarType::kUInt8, ScalarType::kUInt16,
                                             ScalarType::kUInt32, ScalarType::kUInt64};
  const int power = size == 1 ? 0 : size == 2 ? 1 : size == 4 ? 2 : size == 8 ? 3 : -1;
  if (power >= 0 && kind == "I") return kSigned[power];
  if (power >= 0 && kind == "U") return kUnsigned[power];
  if (power >= 2 && kind == "F") return power == 2 ? ScalarType::kFloat32 : ScalarType::kFloat64;
  throw std::runtime_error("its header has a field of unknown type " + quoted(kind) + " and size " +
                           std::to_string(size));
}

std::size_t toCount(std::string_view word) {
  const long long count = toInteger(word);
  if (count < 0 || count > std::numeric_limits<std::uint32_t>::max()) {
    throw std::runtime_error("its header has the impossible count " + quoted(word));
  }
  return static_cast<std::size_t>(count);
}

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> result;
  for (auto word = takeWord(line); !word.empty(); word = takeWord(line)) result.push_back(word);
  return result;
}

// SIZE, TYPE and COUNT hold a word for each of FIELDS; COUNT may be missing.
std::vector<Field> fieldsFrom(const std::vector<std::string_view>& names,
                              const std::vector<std::string_view>& sizes,
                              const std::vector<std::string_view>& types,
                              const std::vector<std::string_view>& counts) {
  if (names.empty() || sizes.size() != names.size() || types.size() != names.size() ||
      (!counts.empty() && counts.size() != names.size())) {
    throw std::runtime_error("FIELDS, SIZE, TYPE and COUNT in its header do not fit together");
  }
  std::vector<Field> fields;
  for (std::size_t i = 0; i < names.size(); ++i) {
    fields.push_back({std::string(names[i]), scalarType(types[i], toInteger(sizes[i])),
                      counts.empty() ? 1 : toCount(counts[i])});
    if (fields.back().count == 0) throw std::runtime_error("its header has a COUNT of 0");
  }
  return fields;
}

// Takes the header off `file`.
Header takeHeader(std::string_view& file) {
  Header header;
  std::vector<std::string_view> names, sizes, types, counts;
  std::size_t width = 0, height = 1;
  std::optional<std::size_t> points;
  while (header.data.empty()) {
    if (file.empty()) throw std::runtime_error("its header does not end with DATA");
    std::string_view line = takeLine(file);
    const std::string_view keyword = takeWord(line);
    if (keyword == "FIELDS" || keyword == "COLUMNS") names = words(line);
    if (keyword == "SIZE") sizes = words(line);
    if (keyword == "TYPE") types = words(line);
    if (keyword == "COUNT") counts = words(line);
    if (keyword == "WIDTH") width = toCount(takeWord(line));
    if (keyword == "HEIGHT") height = toCount(takeWord(line));
    if (keyword == "POINTS") points = toCount(takeWord(line));
    if (keyword == "VIEWPOINT") {
      Eigen::Vector3d& viewpoint = header.viewpoint.emplace();
      for (int axis = 0; axis < 3; ++axis) viewpoint[axis] = toNumber(takeWord(line));
      if (header.viewpoint->isZero()) header.viewpoint.reset();  // so does who knows of none
    }
    if (keyword == "DATA") header.data = takeWord(line);
  }
  header.fields = fieldsFrom(names, sizes, types, counts);
  constexpr std::size_t kLargestPoint = 1 << 20;  // keeps every size below far from overflow
  if (header.pointBytes() > kLargestPoint) throw std::runtime_error("its header has huge points");
  header.points = points.value_or(width * height);
  if (width * height != header.points) {
    throw std::runtime_error("WIDTH, HEIGHT and POINTS in its header do not fit together");
  }
  return header;
}

// The body of a compressed file, decompressed and turned from one field after the other into one
// point after the other.
std::string decompress(std::string_view body, const Header& header) {
  ScalarStream sizes(body, kHostEncoding);
  const auto compressed = static_cast<std::size_t>(sizes.next(ScalarType::kUInt32));
  const auto bytes = static_cast<std::size_t>(sizes.next(ScalarType::kUInt32));
  body.remove_prefix(8);
  constexpr std::size_t kLargestRatio = 100;  // LZF turns 3 bytes into 264 at most
  if (compressed > body.size() || bytes != header.points * header.pointBytes() ||
      bytes > kLargestRatio * compressed) {
    throw std::runtime_error("its compressed data do not fit its header");
  }
  std::string by_field(bytes, '\0');
  if (pcl::lzfDecompress(body.data(), static_cast<unsigned>(compressed), by_field.data(),
                         static_cast<unsigned>(bytes)) != bytes) {
    throw std::runtime_error("its compressed data are damaged");
  }
  std::string by_point(bytes, '\0');
  std::size_t source = 0, offset = 0;
  for (const Field& field : header.fields) {
    for (std::size_t i = 0; i < header.points; ++i, source += field.bytes()) {
      by_field.copy(&by_point[i * header.pointBytes() + offset], field.bytes(), source);
    }
    offset += field.bytes();
  }
  return by_point;
}

void readPoints(const Header& header, ScalarStream stream, RawSurface& surface) {
  std::vector<std::string> names;
  for (const Field& field : header.fields) names.push_back(field.name);
  const VertexColumns columns(names);
  std::vector<double> row(names.size());
  for (std::size_t i = 0; i < header.points; ++i) {
    try {
      for (std::size_t k = 0; k < row.size(); ++k) {
        for (std::size_t j = 0; j < header.fields[k].count; ++j) {
          row[k] = stream.next(header.fields[k].type);
        }
      }
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("at point " + std::to_string(i + 1) + " of " +
                               std::to_string(header.points) + ", " + error.what());
    }
    columns.append(row, surface);
  }
}

}  // namespace

RawSurface parsePcd(std::string_view file) {
  const Header header = takeHeader(file);
  RawSurface surface;
  surface.viewpoint = header.viewpoint;
  if (header.data == "ascii") {
    readPoints(header, {file, Encoding::kText}, surface);
  } else if (header.data == "binary") {
    readPoints(header, {file, kHostEncoding}, surface);
  } else if (header.data == "binary_compressed") {
    readPoints(header, {decompress(file, header), kHostEncoding}, surface);
  } else {
    throw std::runtime_error("its DATA " + quoted(header.data) + " is unknown");
  }
  return surface;
}

}  // namespace unirit
