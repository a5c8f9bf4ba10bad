// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "unirit/io/surface_io.hpp"

namespace unirit::test {

namespace fs = std::filesystem;

// Files of the same two faces in every format.
inline const char* const kCorners = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
inline const char* const kFaces = "3 0 2 1\n3 0 1 3\n";

inline std::string plyHeader(const std::string& format, const std::string& coordinate = "float",
                             const std::string& list = "list uchar int vertex_indices") {
  return "ply\nformat " + format + " 1.0\ncomment made by hand\nelement vertex 4\nproperty " +
         coordinate + " x\nproperty " + coordinate + " y\nproperty " + coordinate +
         " z\nelement face 2\nproperty " + list + "\nend_header\n";
}

inline std::string textPly() { return plyHeader("ascii") + kCorners + kFaces; }

template <class Number>
void append(std::string& bytes, Number number, bool swap) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  if (swap) std::reverse(raw, raw + sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

inline std::string binaryPly(bool big_endian) {
  std::string bytes = plyHeader(big_endian ? "binary_big_endian" : "binary_little_endian");
  const bool swap = big_endian == (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
  for (const float c : {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}) append<float>(bytes, c, swap);
  for (const auto& face : {std::array<int, 3>{0, 2, 1}, std::array<int, 3>{0, 1, 3}}) {
    bytes += '\3';
    for (const int corner : face) append(bytes, corner, swap);
  }
  return bytes;
}

inline std::string binaryStl(const std::string& header) {
  std::string bytes = header + std::string(80 - header.size(), ' ');
  append<std::uint32_t>(bytes, 2, false);
  for (const auto& facet : {std::array<float, 9>{0, 0, 0, 0, 1, 0, 1, 0, 0},
                            std::array<float, 9>{0, 0, 0, 1, 0, 0, 0, 0, 1}}) {
    for (int k = 0; k < 3; ++k) append(bytes, 0.0F, false);
    for (const float coordinate : facet) append(bytes, coordinate, false);
    append<std::uint16_t>(bytes, 0, false);
  }
  return bytes;
}

inline std::string textStl() {
  const std::string facet = " facet normal 0 0 1\n  outer loop\n";
  const std::string end = "  endloop\n endfacet\n";
  return "solid two facets\n" + facet + "vertex 0 0 0\nvertex 0 1 0\nvertex 1 0 0\n" + end + facet +
         "vertex -0 0 0\nvertex 1 0 0\nvertex 0 0 1\n" + end + "endsolid two facets\n";
}

inline std::string textObj() {
  return "# by hand\nmtllib a.mtl\nv 0 0 0 0.5 0.5 0.5\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\n"
         "vn 0 0 1\nf 1/1/1 3//1 2/1\nf -4 -3 -1\n";
}

inline std::string textPcd() {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\n"
         "HEIGHT 1\nVIEWPOINT 0.5 -2 3 1 0 0 0\nPOINTS 4\nDATA ascii\n" +
         std::string(kCorners);
}

/// A folder of its own for the files of each test.
class SurfaceIo : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("unirit_surface_io_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }

  SurfaceFile read(const std::string& name, const std::string& bytes) const {
    return readSurface(write(name, bytes), 1.0);
  }

  // The sentence a file is refused with; empty where it is read.
  std::string refusal(const std::string& name, const std::string& bytes) const {
    try {
      read(name, bytes);
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      return error.what();
    }
    return {};
  }

  fs::path folder_;
};

}  // namespace unirit::test
