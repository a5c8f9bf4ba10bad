// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "unirit/evaluation/pair.hpp"

namespace unirit {

/// Where a case lies, and what its path says of it: ROOT/PROTOCOL/ORGAN_SUBJECT.
struct CaseFolder {
  std::string protocol;
  std::string organ;
  std::string subject;
  std::string path;
};

/// Every case below `root`, by protocol, organ and subject; a folder is one where it holds a
/// case.json. Throws std::runtime_error where `root` is no folder or holds no case.
std::vector<CaseFolder> listCaseFolders(const std::string& root);

/// Reads source.ply (with normals), target.ply, truth.ply, points.ply, points_truth.ply (both
/// inside the organ), surface.ply (samples of the true surface) and case.json ("viewpoint": null
/// or [x, y, z], "rmse_before_mm"), all in millimetres; docs/pairs.md describes them. Throws
/// std::runtime_error with a sentence that names the file and what is wrong with it: missing,
/// damaged, of another length than its counterpart, or rows that do not belong together.
RegistrationPair readCaseFolder(const std::string& path);

}  // namespace unirit
