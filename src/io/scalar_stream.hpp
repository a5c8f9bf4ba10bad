// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace unirit {

/// Number types that stand in PLY and PCD files.
enum class ScalarType {
  kInt8,
  kUInt8,
  kInt16,
  kUInt16,
  kInt32,
  kUInt32,
  kInt64,
  kUInt64,
  kFloat32,
  kFloat64
};

enum class Encoding { kText, kLittleEndian, kBigEndian };

/// Order of bytes of the machine this runs on.
inline constexpr Encoding kHostEncoding =
    __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? Encoding::kBigEndian : Encoding::kLittleEndian;

std::size_t sizeOf(ScalarType type);

/// Takes the first line off `text`, without its LF or CR LF. At the end the line is empty.
std::string_view takeLine(std::string_view& text);

/// Takes the first word off `text`, skipping white space before it. At the end the word is empty.
std::string_view takeWord(std::string_view& text);

/// The word in quotation marks, short and printable, for a message.
std::string quoted(std::string_view word);

/// A number such as "-1.5e3", "+2" or "nan". Throws std::runtime_error naming what is none.
double toNumber(std::string_view word);

/// A whole number; throws std::runtime_error naming what is none.
long long toInteger(std::string_view word);

/// Numbers one after another, as words of a text or as bytes.
class ScalarStream {
 public:
  ScalarStream(std::string_view bytes, Encoding encoding) : rest_(bytes), encoding_(encoding) {}

  /// The next number; its type matters only to binary data. Throws std::runtime_error at the end of
  /// the file and where a word is not a number.
  double next(ScalarType type);

  /// Bytes not read yet: no more numbers than these can follow.
  std::size_t remaining() const { return rest_.size(); }

 private:
  std::string_view rest_;
  Encoding encoding_;
};

}  // namespace unirit
