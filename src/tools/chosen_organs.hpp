// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "unirit/io/organ_folder.hpp"

namespace unirit {

/// The organs of the folder `data` but the classes in `exclude`; where it is empty, `phantoms`
/// patients of each phantom organ that training never draws. Says on stderr what was left out.
std::vector<Organ> chosenOrgans(const std::string& data, const std::vector<std::string>& exclude,
                                int phantoms);

}  // namespace unirit
