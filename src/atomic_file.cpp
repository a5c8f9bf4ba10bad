// SPDX-License-Identifier: BSD-3-Clause
#include "atomic_file.hpp"

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

}  // namespace unirit
