// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

namespace unirit {

/// Settings of a rival as "name=value:name=value", in the order of their visit().
template <class Settings>
std::string toText(Settings settings) {
  std::ostringstream text;
  settings.visit([&](const char* name, const auto& value) {
    text << (text.tellp() > 0 ? ":" : "") << name << '=' << value;
  });
  return text.str();
}

/// Overwrites those settings that `values` names and takes them out of it. Throws
/// std::invalid_argument naming a value that is no number.
template <class Settings>
void take(std::map<std::string, std::string>& values, Settings& settings) {
  settings.visit([&](const std::string& name, auto& value) {
    const auto found = values.find(name);
    if (found == values.end()) return;
    std::istringstream text(found->second);
    if (!(text >> value) || text.peek() != std::istringstream::traits_type::eof()) {
      throw std::invalid_argument(name + ": '" + found->second + "' is no value for it");
    }
    values.erase(found);
  });
}

}  // namespace unirit
