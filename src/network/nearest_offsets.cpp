// SPDX-License-Identifier: BSD-3-Clause
#include "nearest_offsets.hpp"

#include <algorithm>

namespace unirit {

void NearestOffsets::setOthers(const Points& others) {
  others_.resize(static_cast<std::size_t>(others.cols()));
  for (Eigen::Index i = 0; i < others.cols(); ++i) {
    others_[static_cast<std::size_t>(i)] = {others(0, i), others(1, i), others(2, i)};
  }
  std::sort(others_.begin(), others_.end());
}

RowsView NearestOffsets::rows(const Points& points, long begin, long count, Scratch& scratch,
                              const Kernels& kernels) const {
  kernels.nearest(points.data() + 3 * begin, count, others_.front().data(),
                  static_cast<long>(others_.size()), scratch.nearest.data());
  Eigen::Map<Eigen::Matrix<float, 6, Eigen::Dynamic>> rows(scratch.inputs.data(), 6, count);
  for (long i = 0; i < count; ++i) {
    const auto point = points.col(begin + i);
    const auto& nearest = others_[static_cast<std::size_t>(scratch.nearest[i])];
    rows.col(i).head<3>() = point;
    rows.col(i).tail<3>() = Eigen::Map<const Eigen::Vector3f>(nearest.data()) - point;
  }
  return {scratch.inputs.data(), 6, count};
}

}  // namespace unirit
