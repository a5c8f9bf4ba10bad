// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>

namespace unirit {

/// What a file's name says of the organ in it: an organ's class, or a clause that says why none
/// can be told.
struct OrganGuess {
  std::string organ;       ///< class such as "small_bowel", or empty
  std::string problem;     ///< such as "names no organ of the table", or empty
  bool ambiguous = false;  ///< it names more than one thing
};

/// The organ that a file name without extension names somewhere, in any case, by one of the
/// synonyms in the table, words joined or apart: "s0123_liver", "000017_heart_atrium_left",
/// "GallBladder_7". Ambiguous are names of two organs, and those of an organ beside a word for a
/// part of it or what grows in it ("liver_vessel").
OrganGuess organInFileName(const std::string& stem);

/// Whether the table has a class of this very name.
bool isOrgan(const std::string& name);

/// The class whose synonym the folder's whole name is ("Small_Intestine"), else the name itself.
std::string organOfFolder(const std::string& name);

/// Splits "kidney_tumor_kits19_00003" into the class, the longest one known that it begins with,
/// and the subject; at the first underscore where none is known.
std::pair<std::string, std::string> splitOrganAndSubject(const std::string& name);

}  // namespace unirit
