// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <new>

namespace unirit {

/// An array of zeros that starts on a cache line, where the kernels' loads are fastest.
class AlignedFloats {
 public:
  AlignedFloats() = default;
  explicit AlignedFloats(std::size_t size)
      : values_(new (std::align_val_t{kAlignment}) float[size]()), size_(size) {}

  /// At least so many from now on. Where it must grow there are some more, and all are zeros.
  void ensure(std::size_t size) {
    if (size <= size_) return;
    size_ = 0;
    values_.reset();  // not the old and the new at once
    *this = AlignedFloats(size + size / 4);
  }

  float* data() { return values_.get(); }
  const float* data() const { return values_.get(); }

 private:
  static constexpr std::size_t kAlignment = 64;
  struct Delete {
    void operator()(float* values) const {
      ::operator delete[](values, std::align_val_t{kAlignment});
    }
  };
  std::unique_ptr<float[], Delete> values_;
  std::size_t size_ = 0;
};

}  // namespace unirit
