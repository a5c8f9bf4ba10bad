// SPDX-License-Identifier: BSD-3-Clause
#include "safetensors.hpp"

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace unirit {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kLengthBytes = 8;
constexpr char kMetadataKey[] = "__metadata__";

[[noreturn]] void fail(const std::string& clause) { throw std::runtime_error(clause); }

std::uint64_t headerLength(std::string_view file) {
  if (file.empty()) {
    fail("is empty");
  }
  if (file.size() < kLengthBytes) {
    fail("is truncated: a safetensors file has at least 8 bytes, this one " +
         std::to_string(file.size()));
  }
  std::uint64_t length = 0;
  for (std::size_t i = kLengthBytes; i-- > 0;) {
    length = (length << 8) | static_cast<unsigned char>(file[i]);
  }
  if (length > file.size() - kLengthBytes) {
    fail("is truncated or not safetensors: its header claims " + std::to_string(length) +
         " bytes, but only " + std::to_string(file.size() - kLengthBytes) + " follow");
  }
  return length;
}

Json parseHeader(std::string_view header) {
  Json json = Json::parse(header.begin(), header.end(), nullptr, false);
  if (!json.is_object()) {
    fail("is not safetensors: its header is not a JSON object");
  }
  return json;
}

std::map<std::string, std::string> parseMetadata(const Json& json) {
  std::map<std::string, std::string> metadata;
  if (!json.is_object()) {
    fail("is not safetensors: its __metadata__ is not a JSON object");
  }
  for (const auto& [key, value] : json.items()) {
    if (!value.is_string()) {
      fail("is not safetensors: metadata \"" + key + "\" is not a string");
    }
    metadata[key] = value.get<std::string>();
  }
  return metadata;
}

std::vector<std::uint64_t> parseNumbers(const Json& entry, const char* key,
                                        const std::string& name) {
  const auto field = entry.find(key);
  const bool valid = field != entry.end() && field->is_array() &&
                     std::all_of(field->begin(), field->end(),
                                 [](const Json& n) { return n.is_number_unsigned(); });
  if (!valid) {
    fail("is not safetensors: " + std::string(key) + " of tensor \"" + name +
         "\" is not a list of whole numbers");
  }
  return field->get<std::vector<std::uint64_t>>();
}

TensorView parseTensor(const Json& entry, const std::string& name, std::string_view data) {
  if (!entry.is_object() || !entry.contains("dtype") || !entry["dtype"].is_string()) {
    fail("is not safetensors: tensor \"" + name + "\" has no dtype");
  }
  TensorView tensor{entry["dtype"].get<std::string>(), parseNumbers(entry, "shape", name), {}};
  const auto range = parseNumbers(entry, "data_offsets", name);
  if (range.size() != 2 || range[0] > range[1]) {
    fail("is not safetensors: data_offsets of tensor \"" + name + "\" are not a range");
  }
  if (range[1] > data.size()) {
    fail("is truncated: tensor \"" + name + "\" ends at byte " + std::to_string(range[1]) +
         " of the data, which has " + std::to_string(data.size()));
  }
  tensor.bytes = data.substr(range[0], range[1] - range[0]);
  return tensor;
}

/// Every byte of data must belong to one tensor: overlaps and gaps are a sign of tampering.
void requireFullCover(const std::map<std::string, TensorView>& tensors, std::string_view data) {
  std::vector<std::pair<std::string_view, std::string>> ranges;
  for (const auto& [name, tensor] : tensors) {
    ranges.emplace_back(tensor.bytes, name);
  }
  std::sort(ranges.begin(), ranges.end(), [](const auto& a, const auto& b) {
    return a.first.data() != b.first.data() ? a.first.data() < b.first.data()
                                            : a.first.size() < b.first.size();
  });
  const char* end = data.data();
  for (const auto& [bytes, name] : ranges) {
    if (bytes.data() < end) {
      fail("is damaged: tensor \"" + name + "\" overlaps another");
    }
    if (bytes.data() > end) {
      fail("is damaged: no tensor claims the bytes before tensor \"" + name + "\"");
    }
    end = bytes.data() + bytes.size();
  }
  if (end != data.data() + data.size()) {
    fail("is damaged: bytes that no tensor claims follow the last tensor");
  }
}

}  // namespace

TensorFile parseSafetensors(std::string_view file) {
  const std::uint64_t header_length = headerLength(file);
  const Json header = parseHeader(file.substr(kLengthBytes, header_length));
  const std::string_view data = file.substr(kLengthBytes + header_length);

  TensorFile content;
  for (const auto& [name, entry] : header.items()) {
    if (name == kMetadataKey) {
      content.metadata = parseMetadata(entry);
    } else {
      content.tensors[name] = parseTensor(entry, name, data);
    }
  }
  requireFullCover(content.tensors, data);
  return content;
}

std::string formatSafetensorsHeader(const std::map<std::string, std::string>& metadata,
                                    const std::map<std::string, TensorLayout>& tensors) {
  Json json;
  json[kMetadataKey] = metadata;
  std::uint64_t offset = 0;
  for (const auto& [name, tensor] : tensors) {
    json[name] = {{"dtype", tensor.type},
                  {"shape", tensor.shape},
                  {"data_offsets", {offset, offset + tensor.size}}};
    offset += tensor.size;
  }
  std::string header = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  header.append((8 - header.size() % 8) % 8, ' ');

  std::string bytes;
  for (std::size_t i = 0; i < kLengthBytes; ++i) {
    bytes += static_cast<char>((static_cast<std::uint64_t>(header.size()) >> (8 * i)) & 0xFF);
  }
  return bytes + header;
}

std::string formatSafetensors(const TensorFile& content) {
  std::map<std::string, TensorLayout> layouts;
  for (const auto& [name, tensor] : content.tensors) {
    layouts[name] = {tensor.type, tensor.shape, tensor.bytes.size()};
  }
  std::string file = formatSafetensorsHeader(content.metadata, layouts);
  for (const auto& [name, tensor] : content.tensors) {
    file += tensor.bytes;
  }
  return file;
}

}  // namespace unirit
