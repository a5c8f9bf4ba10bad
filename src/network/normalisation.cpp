// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "unirit/network/network.hpp"

namespace unirit {

Normalisation Normalisation::of(const Points& source) {
  Normalisation normalisation;
  normalisation.offset = centroid(source);
  normalisation.scale = (source.colwise() - normalisation.offset).cwiseAbs().maxCoeff();
  if (!(normalisation.scale > 0.0F)) {
    throw std::invalid_argument("source: all points coincide, so there is no length to scale by");
  }
  return normalisation;
}

Points Normalisation::apply(const Points& points) const {
  return (points.colwise() - offset) / scale;
}

}  // namespace unirit
