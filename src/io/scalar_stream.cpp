// SPDX-License-Identifier: BSD-3-Clause
#include "scalar_stream.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <stdexcept>

namespace unirit {
namespace {

constexpr std::string_view kSpace = " \t\r\n\v\f";

template <class Number>
Number parse(std::string_view word, const char* kind) {
  const std::string_view digits = word.substr(word.substr(0, 1) == "+" ? 1 : 0);
  Number value{};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size()) {
    throw std::runtime_error(word.empty() ? std::string(kind) + " is missing"
                                          : quoted(word) + " is not " + kind);
  }
  return value;
}

template <class Number>
double as(const char* bytes) {
  Number value;
  std::memcpy(&value, bytes, sizeof(value));
  return static_cast<double>(value);
}

double decode(const char* bytes, ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
      return as<std::int8_t>(bytes);
    case ScalarType::kUInt8:
      return as<std::uint8_t>(bytes);
    case ScalarType::kInt16:
      return as<std::int16_t>(bytes);
    case ScalarType::kUInt16:
      return as<std::uint16_t>(bytes);
    case ScalarType::kInt32:
      return as<std::int32_t>(bytes);
    case ScalarType::kUInt32:
      return as<std::uint32_t>(bytes);
    case ScalarType::kInt64:
      return as<std::int64_t>(bytes);
    case ScalarType::kUInt64:
      return as<std::uint64_t>(bytes);
    case ScalarType::kFloat32:
      return as<float>(bytes);
    case ScalarType::kFloat64:
      return as<double>(bytes);
  }
  throw std::logic_error("unknown scalar type");
}

}  // namespace

std::size_t sizeOf(ScalarType type) {
  switch (type) {
    case ScalarType::kInt8:
    case ScalarType::kUInt8:
      return 1;
    case ScalarType::kInt16:
    case ScalarType::kUInt16:
      return 2;
    case ScalarType::kInt32:
    case ScalarType::kUInt32:
    case ScalarType::kFloat32:
      return 4;
    default:
      return 8;
  }
}

std::string_view takeLine(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view takeWord(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kSpace), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kSpace));
  text.remove_prefix(word.size());
  return word;
}

std::string quoted(std::string_view word) {
  std::string text(word.substr(0, 40));
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return '"' + text + '"';
}

double toNumber(std::string_view word) { return parse<double>(word, "a number"); }

long long toInteger(std::string_view word) { return parse<long long>(word, "a whole number"); }

double ScalarStream::next(ScalarType type) {
  if (encoding_ == Encoding::kText) {
    const std::string_view word = takeWord(rest_);
    if (word.empty()) throw std::runtime_error("the file ends too early");
    return toNumber(word);
  }
  const std::size_t size = sizeOf(type);
  if (rest_.size() < size) throw std::runtime_error("the file ends too early");
  std::array<char, 8> bytes;
  std::copy_n(rest_.begin(), size, bytes.begin());
  if (encoding_ != kHostEncoding) std::reverse(bytes.begin(), bytes.begin() + size);
  rest_.remove_prefix(size);
  return decode(bytes.data(), type);
}

}  // namespace unirit
