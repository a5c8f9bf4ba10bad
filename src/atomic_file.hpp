// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <ostream>
#include <string>

namespace unirit {

/// Writes a file beside its place and moves it there when it is whole: a file of that name is never
/// half written. Throws std::runtime_error "WHAT PATH cannot be written".
void writeAtomically(const std::string& path, const std::string& what,
                     const std::function<void(std::ostream&)>& write);

/// Throws std::runtime_error "PATH cannot be written" where it could not be, its folder made or
/// not: known before the work rather than after it.
void requirePlaceFor(const std::string& path);

}  // namespace unirit
