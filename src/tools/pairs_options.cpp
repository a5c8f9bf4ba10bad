// SPDX-License-Identifier: BSD-3-Clause
#include "pairs_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <thread>

namespace unirit {
namespace {

const char* const kDescription =
    "Makes registration pairs with known truth from organ surfaces: ORGAN/*.{ply,stl,obj,pcd}, or\n"
    "one flat folder whose file names tell the organ. Writes one safetensors file and, beside it,\n"
    "a JSON manifest of seeds, parameters and sources.";

const char* const kExitStatus =
    "Exit status: 0 the set is written, 2 unusable arguments, no pair made or a file cannot be\n"
    "written. Files that are left out do not change it; each is named with the reason.";

constexpr double kMillimetre = 0.001;

/// "liver=130:380": the organ's plausible length in millimetres.
void addLengthRange(const std::string& text, ScreeningLimits& limits) {
  const std::size_t equals = text.find('=');
  double least = 0.0, most = 0.0;
  char rest = 0;
  const int read = equals == std::string::npos || equals == 0
                       ? 0
                       : std::sscanf(text.c_str() + equals + 1, "%lf:%lf%c", &least, &most, &rest);
  if (read != 2 || !(least >= 0.0 && least < most)) {
    throw CLI::ValidationError("--length", "\"" + text + "\" is not ORGAN=LEAST:MOST");
  }
  limits.lengths[text.substr(0, equals)] = {kMillimetre * least, kMillimetre * most};
}

void addScreening(CLI::App& app, ScreeningLimits& limits, std::vector<std::string>& lengths) {
  const char* const group = "Screening";
  app.add_option("--min-faces", limits.min_faces, "fewer are a fragment")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(group);
  app.add_option("--max-open-share", limits.max_open_share,
                 "flat area of the holes over that of the surface, at most")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(group);
  app.add_option("--min-main-piece", limits.min_main_piece,
                 "share of the surface in its largest connected piece, at least")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  app.add_option("--length", lengths,
                 "plausible length of an organ in mm, such as liver=130:380, in place of the\n"
                 "built-in one; may be repeated")
      ->type_name("ORGAN=LEAST:MOST")
      ->group(group);
}

}  // namespace

ParsedPairsOptions parsePairsOptions(int argc, char** argv) {
  ParsedPairsOptions parsed;
  PairsOptions& options = parsed.options;
  PairSettings& settings = options.settings;
  std::vector<std::string> protocols{"permuted", "resampled", "caseb", "partial"}, lengths;
  std::string units = "mm";
  settings.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));

  CLI::App app(kDescription, "unirit_pairs");
  app.footer(kExitStatus);
  app.add_option("--data", options.data, "folder of organ surfaces; may be repeated");
  app.add_option("--phantoms", options.phantoms, "digital phantoms of each organ")
      ->check(CLI::Range(0, 10000));
  app.add_option("--output", options.output, "pair set to write, such as pairs.safetensors")
      ->required();
  app.add_option("--exclude", options.exclude, "organ classes left out, such as small_bowel");
  app.add_option("--protocols", protocols,
                 "paired, permuted, resampled, caseb, partial, offset, intraop, camera; or all")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--points", settings.points, "of each cloud")
      ->check(CLI::Range(8, 10000))
      ->capture_default_str();
  app.add_option("--surface-samples", settings.surface_samples,
                 "of the true surface, kept for the surface distance")
      ->check(CLI::Range(0, 30000))
      ->capture_default_str();
  app.add_option("--deformations", settings.deformations, "of each surface")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--variations", settings.variations,
                 "further anatomies made of each surface by smooth random variation")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  app.add_option("--subjects", settings.subjects,
                 "classes of fewer surfaces are filled up with varied anatomies")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  app.add_option("--seed", settings.seed, "of everything drawn")->capture_default_str();
  app.add_option("--threads", settings.threads, "the set has the same bits for any number")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--units", units, "unit of the surfaces' files: mm or m")
      ->check(CLI::IsMember({"mm", "m"}))
      ->capture_default_str();
  app.add_option("--divergences", options.divergences,
                 "also writes a Markdown table of the divergence L_mc of organ against organ");
  app.add_option("--components", options.divergence.components,
                 "of the Gaussian mixtures behind that table")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  addScreening(app, settings.limits, lengths);

  try {
    app.parse(argc, argv);
    if (protocols == std::vector<std::string>{"all"}) {
      settings.protocols = allProtocols();
    } else {
      for (const std::string& name : protocols) {
        settings.protocols.push_back(protocolFromString(name));
      }
    }
    for (const std::string& text : lengths) addLengthRange(text, settings.limits);
    if (std::filesystem::path(options.output).extension() == ".json") {
      throw CLI::ValidationError("--output", "the pair set would have the name of its manifest");
    }
    if (options.data.empty() && options.phantoms == 0) {
      throw CLI::ValidationError("no organs", "give --data FOLDER or --phantoms N");
    }
  } catch (const CLI::Success& help) {
    parsed.exit_status = app.exit(help);
  } catch (const std::exception& error) {
    std::cerr << "unirit_pairs: " << error.what() << '\n';
    parsed.exit_status = 2;
  }
  options.unit = units == "m" ? 1.0 : kMillimetre;
  return parsed;
}

}  // namespace unirit
