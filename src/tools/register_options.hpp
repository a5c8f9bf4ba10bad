// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>

namespace unirit {

/// The command line of unirit_register.
struct RegisterOptions {
  std::string preoperative;                   // file
  std::string intraoperative;                 // file
  std::string output = ".";                   // folder
  std::string weights;                        // file; empty: the package's own
  std::string settings;                       // file; empty: defaults
  std::string stages;                         // empty: those of the settings
  std::string correspondence;                 // empty: that of the settings
  std::string points;                         // file; empty: none
  std::optional<Eigen::Vector3f> viewpoint;   // in the intra-operative frame [m]
  std::optional<Eigen::AlignedBox3d> region;  // in the same frame [m]; none: everything
  double unit = 0.001;                        // of all files [m]
  std::optional<int> threads;                 // none: that of the settings
  std::uint64_t seed = 0;
};

/// Reads the command line. An int is the exit status with which to end at once: 0 after --help or
/// --version, 2 after a sentence on stderr.
struct ParsedOptions {
  RegisterOptions options;
  std::optional<int> exit_status;
};
ParsedOptions parseRegisterOptions(int argc, char** argv);

}  // namespace unirit
