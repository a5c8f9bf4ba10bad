// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/organ_folder.hpp"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "unirit/io/surface_io.hpp"

namespace unirit {

std::vector<Organ> readOrgans(const std::string& folder, double unit,
                              const std::vector<std::string>& exclude,
                              const std::function<void(const std::string&)>& left_out) {
  namespace fs = std::filesystem;
  if (!fs::is_directory(folder)) throw std::runtime_error(folder + ": not a folder");
  std::vector<fs::path> paths;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());

  std::vector<Organ> organs;
  for (const fs::path& path : paths) {
    const std::string name = path.parent_path().filename();
    if (std::count(exclude.begin(), exclude.end(), name) > 0) continue;
    try {
      Surface surface = readSurface(path, unit).surface;
      if (surface.faces.cols() == 0) throw std::runtime_error(path.string() + ": has no faces");
      organs.push_back({name, path.stem(), std::move(surface)});
    } catch (const std::runtime_error& error) {
      left_out(error.what());
    }
  }
  return organs;
}

}  // namespace unirit
