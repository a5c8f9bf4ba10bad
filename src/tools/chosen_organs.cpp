// SPDX-License-Identifier: BSD-3-Clause
#include "chosen_organs.hpp"

#include <iostream>

#include "unirit/evaluation/deformable_organs.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit {
namespace {

constexpr double kMillimetre = 0.001;
constexpr std::uint64_t kUnseenPatients = 900000000;  // phantom seeds that training never draws

}  // namespace

std::vector<Organ> chosenOrgans(const std::string& data, const std::vector<std::string>& exclude,
                                int phantoms) {
  if (!data.empty()) {
    return readDeformableOrgans(data, kMillimetre, exclude, [](const std::string& sentence) {
      std::cerr << "left out: " << sentence << '\n';
    });
  }
  std::vector<Organ> organs;
  for (const std::string& name : phantomOrgans()) {
    for (int i = 0; i < phantoms; ++i) {
      organs.push_back({name, std::to_string(i), makePhantom(name, kUnseenPatients + i)});
    }
  }
  return organs;
}

}  // namespace unirit
