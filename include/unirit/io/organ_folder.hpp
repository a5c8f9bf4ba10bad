// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "unirit/point_cloud.hpp"

namespace unirit {

/// An organ's surface and what it is called.
struct Organ {
  std::string name;     ///< class, "liver"
  std::string subject;  ///< file name without extension
  Surface surface;      ///< metres
};

/// A file that should hold an organ's surface.
struct OrganFile {
  std::string organ;    ///< class, "liver"
  std::string subject;  ///< file name without extension
  std::string path;
  std::string name;  ///< path below the folder listed
};

/// Every file below `folder` that may be a mesh, in the order of the paths. The class is told by
/// the folder that a file lies in (ORGAN/SUBJECT.{ply,stl,obj,pcd}) where that is a known organ or
/// a synonym, else by the file's name (s0123_liver.stl; see organInFileName), else by the folder's
/// name as it stands, unless it is `folder` itself. Files of other kinds or whose organ cannot be
/// told are left out, each with a sentence to `left_out`; hidden ones silently. Throws
/// std::runtime_error where `folder` is none.
std::vector<OrganFile> listOrganFiles(const std::string& folder,
                                      const std::function<void(const std::string&)>& left_out);

/// The surface of the file, turned where its faces look inwards. `unit`: the file's, in metres.
/// Throws std::runtime_error with a sentence that names the file where it cannot be read or has no
/// faces.
Surface readOrganSurface(const OrganFile& file, double unit);

/// Every mesh that listOrganFiles finds, but the classes in `exclude`. Those that cannot be read or
/// have no faces are left out too.
std::vector<Organ> readOrgans(const std::string& folder, double unit,
                              const std::vector<std::string>& exclude,
                              const std::function<void(const std::string&)>& left_out);

}  // namespace unirit
