// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/io/organ_folder.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "unirit/io/organ_names.hpp"
#include "unirit/io/surface_io.hpp"
#include "unirit/normals.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

bool isMeshFile(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  constexpr const char* kExtensions[] = {".ply", ".stl", ".obj", ".pcd"};
  return std::count(std::begin(kExtensions), std::end(kExtensions), extension) > 0;
}

/// By the folder where that is a known organ, else by the file's name; where that is silent, a
/// folder below the root counts as it stands.
OrganGuess organOf(const fs::path& path, const fs::path& root) {
  const std::string folder = organOfFolder(path.parent_path().filename().string());
  const bool flat = path.parent_path() == root;
  if (isOrgan(folder)) return {folder, {}};
  const OrganGuess guess = organInFileName(path.stem().string());
  return flat || !guess.organ.empty() || guess.ambiguous ? guess : OrganGuess{folder, {}};
}

}  // namespace

std::vector<OrganFile> listOrganFiles(const std::string& folder,
                                      const std::function<void(const std::string&)>& left_out) {
  const fs::path root = fs::path(folder).lexically_normal();
  if (!fs::is_directory(root)) throw std::runtime_error(folder + ": not a folder");
  std::vector<fs::path> paths;
  const auto links_too = fs::directory_options::follow_directory_symlink;
  for (const auto& entry : fs::recursive_directory_iterator(root, links_too)) {
    const bool hidden = entry.path().filename().string().front() == '.';
    const bool file = entry.is_regular_file() || !entry.exists();  // a link that leads nowhere, too
    if (file && !hidden) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());

  // "organs/" and "organs" are the same folder
  const fs::path parent = root.has_filename() ? root : root.parent_path();
  std::vector<OrganFile> files;
  for (const fs::path& path : paths) {
    if (!isMeshFile(path)) {
      left_out(path.string() + ": its extension is none of .ply, .pcd, .stl, .obj");
      continue;
    }
    const OrganGuess guess = organOf(path, parent);
    if (guess.organ.empty()) {
      left_out(path.string() + ": its name " + guess.problem);
      continue;
    }
    files.push_back({guess.organ, path.stem().string(), path.string(),
                     path.lexically_relative(parent).string()});
  }
  return files;
}

Surface readOrganSurface(const OrganFile& file, double unit) {
  Surface surface = readSurface(file.path, unit).surface;
  if (surface.faces.cols() == 0) throw std::runtime_error(file.path + ": has no faces");
  turnFacesOutwards(surface);
  return surface;
}

std::vector<Organ> readOrgans(const std::string& folder, double unit,
                              const std::vector<std::string>& exclude,
                              const std::function<void(const std::string&)>& left_out) {
  std::vector<Organ> organs;
  for (const OrganFile& file : listOrganFiles(folder, left_out)) {
    if (std::count(exclude.begin(), exclude.end(), file.organ) > 0) continue;
    try {
      organs.push_back({file.organ, file.subject, readOrganSurface(file, unit)});
    } catch (const std::runtime_error& error) {
      left_out(error.what());
    }
  }
  return organs;
}

}  // namespace unirit
