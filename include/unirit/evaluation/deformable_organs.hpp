// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "unirit/io/organ_folder.hpp"

namespace unirit {

/// The organs of a folder that pairs can be made of: as readOrgans has it, and those whose surface
/// cannot be deformed (without area, flat) are left out too, each with a sentence.
std::vector<Organ> readDeformableOrgans(const std::string& folder, double unit,
                                        const std::vector<std::string>& exclude,
                                        const std::function<void(const std::string&)>& left_out);

}  // namespace unirit
