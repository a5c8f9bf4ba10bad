// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace unirit {

/// A tensor of a safetensors file; `bytes` points into the file's bytes.
struct TensorView {
  std::string type;                  ///< "F16", "F32", ... as the file says
  std::vector<std::uint64_t> shape;  ///< outermost dimension first
  std::string_view bytes;
};

struct TensorFile {
  std::map<std::string, std::string> metadata;
  std::map<std::string, TensorView> tensors;
};

/// Reads the header (8 bytes of length, JSON, then data:
/// https://github.com/huggingface/safetensors) and checks every range against the file: the data
/// must be covered once, without gap or overlap. Throws std::runtime_error with a clause that
/// continues "the file ...".
TensorFile parseSafetensors(std::string_view file);

/// A tensor whose bytes are written apart.
struct TensorLayout {
  std::string type;
  std::vector<std::uint64_t> shape;
  std::uint64_t size = 0;  ///< [byte]
};

/// What stands before the tensors' bytes, which follow in the map's sequence, without gaps.
std::string formatSafetensorsHeader(const std::map<std::string, std::string>& metadata,
                                    const std::map<std::string, TensorLayout>& tensors);

/// The bytes of a file with these tensors, its data aligned to 8 bytes.
std::string formatSafetensors(const TensorFile& content);

}  // namespace unirit
