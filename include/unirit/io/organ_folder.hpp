// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// An organ's surface and what it is called.
struct Organ {
  std::string name;     ///< class: the folder it lay in, "liver"
  std::string subject;  ///< file name without extension
  Surface surface;      ///< metres
};

/// Every mesh below `folder`, laid out ORGAN/SUBJECT.{ply,stl,obj,pcd}, in the order of the paths,
/// but the classes in `exclude`. Files that cannot be read or have no faces are left out, each
/// with a sentence to `left_out`. Throws std::runtime_error where `folder` is none.
std::vector<Organ> readOrgans(const std::string& folder, double unit,
                              const std::vector<std::string>& exclude,
                              const std::function<void(const std::string&)>& left_out);

}  // namespace unirit
