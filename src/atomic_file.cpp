// SPDX-License-Identifier: BSD-3-Clause
#include "atomic_file.hpp"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace unirit {

void writeAtomically(const std::string& path, const std::string& what,
                     const std::function<void(std::ostream&)>& write) {
  namespace fs = std::filesystem;
  const std::string temporary = path + ".tmp";
  std::ofstream stream(temporary, std::ios::binary);
  write(stream);
  stream.close();
  std::error_code error;
  if (stream) {
    fs::rename(temporary, path, error);
  }
  if (!stream || error) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw std::runtime_error(what + " " + path + " cannot be written");
  }
}

void requirePlaceFor(const std::string& path) {
  namespace fs = std::filesystem;
  fs::path folder = fs::absolute(path).parent_path();
  while (!fs::exists(folder)) folder = folder.parent_path();
  const bool usable = fs::is_directory(folder) && ::access(folder.c_str(), W_OK | X_OK) == 0;
  if (!usable || fs::is_directory(path)) throw std::runtime_error(path + " cannot be written");
}

}  // namespace unirit
