// SPDX-License-Identifier: BSD-3-Clause
#include "register_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iostream>

namespace unirit {
namespace {

const char* const kDescription =
    "Registers the pre-operative surface of an organ (PREOP) to an intra-operative surface or "
    "point\n"
    "cloud (INTRAOP) and writes rigid.ply, deformed.ply and result.json. Reads PLY, PCD, STL, "
    "OBJ.\n"
    "Research software, not a medical device.";

const char* const kExitStatus =
    "Exit status: 0 registered, 1 internal failure, 2 unusable arguments or input (nothing is\n"
    "written), 3 refused by a plausibility check (result.json says which).";

// CLI11 may break its sentence over lines.
std::string onOneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

template <std::size_t N>
void requireFinite(const char* option, const std::array<double, N>& numbers) {
  if (Eigen::Map<const Eigen::Array<double, N, 1>>(numbers.data()).allFinite()) return;
  throw CLI::ValidationError(option, "must be " + std::to_string(N) + " finite numbers");
}

}  // namespace

ParsedOptions parseRegisterOptions(int argc, char** argv) {
  ParsedOptions parsed;
  RegisterOptions& options = parsed.options;
  std::string units = "mm";
  std::array<double, 3> viewpoint{};
  std::array<double, 6> region{};

  CLI::App app(kDescription, "unirit_register");
  app.footer(kExitStatus);
  app.set_version_flag("--version", "unirit " UNIRIT_VERSION);
  app.add_option("PREOP", options.preoperative, "organ's surface: a mesh or a cloud")->required();
  app.add_option("INTRAOP", options.intraoperative, "what is seen of it")->required();
  app.add_option("--output", options.output, "folder for the results; made if need be")
      ->capture_default_str();
  app.add_option("--weights", options.weights, "network's weights; default: the package's own");
  app.add_option("--settings", options.settings, "YAML file such as config/unirit.yaml");
  app.add_option("--stages", options.stages,
                 "some of rigid,nonrigid,refine, in this order; default: all");
  app.add_option("--correspondence", options.correspondence,
                 "what a point of INTRAOP is: anywhere on the surface, or one of PREOP's points, "
                 "moved; for the refinement; default: surface")
      ->type_name("surface|points");
  app.add_option("--points", options.points,
                 "further points of the pre-operative frame, such as a tumour: written, moved, as "
                 "points.ply");
  const CLI::Option* viewpoint_option =
      app.add_option("--viewpoint", viewpoint,
                     "where the sensor stood, in INTRAOP's frame and unit; default: what a PCD "
                     "says, else unknown")
          ->type_name("X Y Z");
  const CLI::Option* region_option =
      app.add_option("--region", region,
                     "two corners of a box in INTRAOP's frame and unit; what lies outside of it is "
                     "left out")
          ->type_name("X Y Z X Y Z");
  app.add_option("--units", units, "unit of all files: mm or m")
      ->check(CLI::IsMember({"mm", "m"}))
      ->capture_default_str();
  app.add_option("--threads", options.threads, "worker threads; default: that of the settings");
  app.add_option("--seed", options.seed, "of the points drawn on the faces of a coarse mesh")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();

  try {
    app.parse(argc, argv);
    requireFinite("--viewpoint", viewpoint);
    requireFinite("--region", region);
  } catch (const CLI::Success& help) {
    parsed.exit_status = app.exit(help);
  } catch (const CLI::Error& error) {
    std::cerr << "unirit_register: " << onOneLine(error.what()) << "\n";
    parsed.exit_status = 2;
  }
  options.unit = units == "m" ? 1.0 : 0.001;
  if (viewpoint_option->count() > 0) {
    options.viewpoint = (options.unit * Eigen::Vector3d(viewpoint.data())).cast<float>();
  }
  if (region_option->count() > 0) {
    const Eigen::Vector3d a = options.unit * Eigen::Map<const Eigen::Vector3d>(region.data());
    const Eigen::Vector3d b = options.unit * Eigen::Map<const Eigen::Vector3d>(region.data() + 3);
    options.region.emplace(a.cwiseMin(b), a.cwiseMax(b));
  }
  return parsed;
}

}  // namespace unirit
