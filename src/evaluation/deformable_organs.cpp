// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/deformable_organs.hpp"

#include <stdexcept>
#include <utility>

#include "unirit/evaluation/pair.hpp"

namespace unirit {

std::vector<Organ> readDeformableOrgans(const std::string& folder, double unit,
                                        const std::vector<std::string>& exclude,
                                        const std::function<void(const std::string&)>& left_out) {
  constexpr std::uint64_t kAnySeed = 1;
  constexpr Eigen::Index kFewPoints = 100;
  std::vector<Organ> organs;
  for (Organ& organ : readOrgans(folder, unit, exclude, left_out)) {
    try {
      DeformedOrgan(organ.surface, kAnySeed, kFewPoints);
      organs.push_back(std::move(organ));
    } catch (const std::invalid_argument& error) {
      left_out(organ.name + " " + organ.subject + ": cannot be deformed (" + error.what() + ")");
    }
  }
  return organs;
}

}  // namespace unirit
