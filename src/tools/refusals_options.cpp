// SPDX-License-Identifier: BSD-3-Clause
#include "refusals_options.hpp"

#include <CLI/CLI.hpp>

namespace unirit {

std::optional<RefusalsOptions> parseRefusalsOptions(int argc, char** argv, int& exit_status) {
  CLI::App app{
      "Registers organs to their own clouds and, on purpose, to what should be refused: clouds of\n"
      "other organs, table tops, other units, starts far off, small views, clouds half another\n"
      "organ's. Writes a row for each with the value of every plausibility check."};
  RefusalsOptions options;
  auto* data = app.add_option("--data", options.data,
                              "Folder of organ surfaces, ORGAN/*.{ply,stl,obj,pcd}, mm");
  app.add_option("--phantoms", options.phantoms,
                 "Digital phantoms of each organ, in place of --data")
      ->check(CLI::Range(1, 1000))
      ->excludes(data);
  app.add_option("--exclude", options.exclude, "Organ classes left out")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--subjects", options.subjects, "Subjects of each organ class, at most")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--rounds", options.rounds, "Rounds of trials for each organ")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--points", options.points, "Points of each cloud")
      ->check(CLI::Range(64, 3000))
      ->capture_default_str();
  app.add_option("--seed", options.seed)->capture_default_str();
  app.add_option("--weights", options.weights, "Weights file")->required();
  app.add_option("--settings", options.settings, "YAML file of settings; default: the built-in");
  app.add_option("--output", options.output, "Folder for registrations.csv and limits.csv")
      ->capture_default_str();
  app.add_option("--threads", options.threads,
                 "Registrations at a time; the rows are the same for any number")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  try {
    app.parse(argc, argv);
    if (options.data.empty() && options.phantoms == 0) {
      throw CLI::RequiredError("one of --data, --phantoms");
    }
  } catch (const CLI::ParseError& error) {
    exit_status = app.exit(error) == 0 ? 0 : 2;
    return std::nullopt;
  }
  return options;
}

}  // namespace unirit
