// SPDX-License-Identifier: BSD-3-Clause
// Runs a rival on two clouds of text, so that it can be compared with the program it comes from.
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <vector>

#include "unirit/evaluation/point_drift.hpp"

namespace {

using namespace unirit;  // NOLINT

Eigen::Matrix3Xd readPoints(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::vector<double> numbers;
  for (double number = 0.0; file >> number;) numbers.push_back(number);
  if (!file.eof() || numbers.empty() || numbers.size() % 3 != 0) {
    throw std::runtime_error(path + ": must hold three numbers a line");
  }
  return Eigen::Map<Eigen::Matrix3Xd>(numbers.data(), 3,
                                      static_cast<Eigen::Index>(numbers.size() / 3));
}

void writePoints(const Eigen::Matrix3Xd& points, const std::string& path) {
  const Eigen::IOFormat full(Eigen::FullPrecision, Eigen::DontAlignCols, " ", "\n");
  std::ofstream file(path);
  file << points.transpose().format(full) << '\n';
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

template <class Settings>
void addOptions(CLI::App& command, Settings& settings) {
  settings.visit([&](const std::string& name, auto& value) {
    command.add_option("--" + name, value)->capture_default_str();
  });
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app{
      "Moves SOURCE to TARGET by a rival of the benchmark. Clouds are text, a point a line, taken "
      "as they are: lengths of the settings are in their unit."};
  std::string source, target, output;
  CpdSettings cpd;
  BcpdSettings bcpd;
  app.require_subcommand(1);
  std::map<std::string, CLI::App*> commands;
  for (const std::string name : {"cpd-rigid", "cpd", "bcpd"}) {
    CLI::App* command = app.add_subcommand(name);
    command->add_option("SOURCE", source)->required();
    command->add_option("TARGET", target)->required();
    command->add_option("OUTPUT", output, "SOURCE, moved")->required();
    name == "bcpd" ? addOptions(*command, bcpd) : addOptions(*command, cpd);
    commands[name] = command;
  }
  CLI11_PARSE(app, argc, argv);

  const DriftClouds clouds{readPoints(source), readPoints(target), Eigen::Matrix3Xd(3, 0)};
  const Drift drift = *commands["bcpd"]  ? driftBayesian(clouds, bcpd)
                      : *commands["cpd"] ? driftCoherently(clouds, cpd)
                                         : driftRigidly(clouds, cpd);
  writePoints(drift.source, output);
  std::cout << drift.iterations << " iterations, variance " << drift.variance << '\n';
  return 0;
} catch (const std::exception& error) {
  std::cerr << "unirit_rival: " << error.what() << '\n';
  return 2;
}
