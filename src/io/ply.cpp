// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <stdexcept>

#include "raw_surface.hpp"
#include "scalar_stream.hpp"

namespace unirit {
namespace {

struct Property {
  std::string name;
  ScalarType type = ScalarType::kFloat32;
  std::optional<ScalarType> count_type;  // of a list
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::optional<Encoding> encoding;
  std::vector<Element> elements;
};

ScalarType scalarType(std::string_view name) {
  static const std::map<std::string_view, ScalarType> types{
      {"char", ScalarType::kInt8},      {"int8", ScalarType::kInt8},
      {"uchar", ScalarType::kUInt8},    {"uint8", ScalarType::kUInt8},
      {"short", ScalarType::kInt16},    {"int16", ScalarType::kInt16},
      {"ushort", ScalarType::kUInt16},  {"uint16", ScalarType::kUInt16},
      {"int", ScalarType::kInt32},      {"int32", ScalarType::kInt32},
      {"uint", ScalarType::kUInt32},    {"uint32", ScalarType::kUInt32},
      {"float", ScalarType::kFloat32},  {"float32", ScalarType::kFloat32},
      {"double", ScalarType::kFloat64}, {"float64", ScalarType::kFloat64}};
  const auto found = types.find(name);
  if (found == types.end()) {
    throw std::runtime_error("its header has the unknown type " + quoted(name));
  }
  return found->second;
}

Encoding encodingFromName(std::string_view name) {
  if (name == "ascii") return Encoding::kText;
  if (name == "binary_little_endian") return Encoding::kLittleEndian;
  if (name == "binary_big_endian") return Encoding::kBigEndian;
  throw std::runtime_error("its format " + quoted(name) + " is unknown");
}

Element elementFromLine(std::string_view line) {
  Element element;
  element.name = takeWord(line);
  const long long count = toInteger(takeWord(line));
  if (count < 0)
    throw std::runtime_error("its header has a negative count of " + quoted(element.name));
  element.count = static_cast<std::size_t>(count);
  return element;
}

Property propertyFromLine(std::string_view line) {
  Property property;
  std::string_view type = takeWord(line);
  if (type == "list") {
    property.count_type = scalarType(takeWord(line));
    type = takeWord(line);
  }
  property.type = scalarType(type);
  property.name = takeWord(line);
  return property;
}

// Takes the header off `file`.
Header takeHeader(std::string_view& file) {
  Header header;
  if (takeWord(file) != "ply") throw std::runtime_error("it does not begin with \"ply\"");
  while (!file.empty()) {
    std::string_view line = takeLine(file);
    const std::string_view keyword = takeWord(line);
    if (keyword == "end_header") {
      if (!header.encoding) throw std::runtime_error("its header has no format");
      return header;
    }
    if (keyword == "format") header.encoding = encodingFromName(takeWord(line));
    if (keyword == "element") header.elements.push_back(elementFromLine(line));
    if (keyword == "property") {
      if (header.elements.empty()) throw std::runtime_error("its header has a stray property");
      header.elements.back().properties.push_back(propertyFromLine(line));
    }
  }
  throw std::runtime_error("its header does not end");
}

void readList(const Property& property, ScalarStream& stream, std::vector<double>& list) {
  const double count = stream.next(*property.count_type);
  if (!(count >= 0.0 && count <= static_cast<double>(stream.remaining()))) {
    throw std::runtime_error("a list is longer than the file");
  }
  list.resize(static_cast<std::size_t>(count));
  for (double& value : list) value = stream.next(property.type);
}

bool isFaceList(const Element& element, const Property& property) {
  return element.name == "face" && property.count_type &&
         (property.name == "vertex_indices" || property.name == "vertex_index");
}

// Reads one vertex, face or other item; `row` and `list` are scratch.
void readItem(const Element& element, const std::optional<VertexColumns>& columns,
              ScalarStream& stream, std::vector<double>& row, std::vector<double>& list,
              RawSurface& surface) {
  row.assign(element.properties.size(), 0.0);
  for (std::size_t i = 0; i < row.size(); ++i) {
    const Property& property = element.properties[i];
    if (property.count_type) {
      readList(property, stream, list);
      if (isFaceList(element, property)) surface.addPolygon(list);
    } else {
      row[i] = stream.next(property.type);
    }
  }
  if (columns) columns->append(row, surface);
}

void readElement(const Element& element, ScalarStream& stream, RawSurface& surface) {
  if (element.properties.empty()) return;
  if (element.name == "tristrips") throw std::runtime_error("triangle strips are not supported");
  if (element.count > stream.remaining()) {
    throw std::runtime_error("its header promises " + std::to_string(element.count) + " of " +
                             quoted(element.name) + ", more than the file can hold");
  }
  std::optional<VertexColumns> columns;
  if (element.name == "vertex") {
    std::vector<std::string> names;
    for (const Property& property : element.properties) {
      names.push_back(property.count_type ? std::string() : property.name);
    }
    columns.emplace(names);
  }
  std::vector<double> row, list;
  for (std::size_t i = 0; i < element.count; ++i) {
    try {
      readItem(element, columns, stream, row, list, surface);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error("at " + quoted(element.name) + " " + std::to_string(i + 1) + " of " +
                               std::to_string(element.count) + ", " + error.what());
    }
  }
}

}  // namespace

RawSurface parsePly(std::string_view file) {
  const Header header = takeHeader(file);
  ScalarStream stream(file, *header.encoding);
  RawSurface surface;
  for (const Element& element : header.elements) readElement(element, stream, surface);
  return surface;
}

}  // namespace unirit
