// SPDX-License-Identifier: BSD-3-Clause
// Command line of the benchmark: organs and weights in, a table of errors out.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>

#include "unirit/evaluation/errors.hpp"
#include "unirit/io/organ_folder.hpp"
#include "unirit/random.hpp"
#include "unirit/simulation/phantom.hpp"

namespace {

using namespace unirit;  // NOLINT

constexpr double kMillimetre = 0.001;
constexpr std::uint64_t kUnseenPatients = 900000000;  // phantom seeds that training never draws

struct Options {
  std::string data;
  std::vector<std::string> exclude{"small_bowel"};
  int phantoms = 0;
  std::string weights;
  std::vector<std::string> protocols{"caseb"};
  std::string start = "identity";
  int pairs = 1;
  int points = 1024;
  double common_rotation = 0.0;  // [degree]
  int threads = 2;
  std::uint64_t seed = 1;
};

void addOptions(CLI::App& app, Options& options) {
  app.add_option("--data", options.data, "Folder of organ surfaces, ORGAN/*.{ply,stl,obj,pcd}, mm");
  app.add_option("--exclude", options.exclude, "Organ classes left out")->capture_default_str();
  app.add_option("--phantoms", options.phantoms,
                 "Digital phantoms of each organ, in place of --data")
      ->check(CLI::Range(0, 1000));
  app.add_option("--weights", options.weights, "Weights file")->required();
  app.add_option("--protocols", options.protocols,
                 "permuted, resampled, caseb, partial, offset, intraop")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--start", options.start, "identity, or centroids brought together")
      ->check(CLI::IsMember({"identity", "centroids"}))
      ->capture_default_str();
  app.add_option("--pairs", options.pairs, "Pairs of each organ")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--points", options.points, "Points of each cloud")
      ->check(CLI::Range(64, 10000))
      ->capture_default_str();
  app.add_option("--common-rotation", options.common_rotation,
                 "Turns both clouds together about random axes, by this angle [degree]")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  app.add_option("--threads", options.threads)->check(CLI::Range(1, 64))->capture_default_str();
  app.add_option("--seed", options.seed)->capture_default_str();
}

std::vector<Organ> organsOf(const Options& options) {
  if (!options.data.empty()) {
    return readOrgans(options.data, kMillimetre, options.exclude, [](const std::string& sentence) {
      std::cerr << "left out: " << sentence << '\n';
    });
  }
  std::vector<Organ> organs;
  for (const std::string& name : phantomOrgans()) {
    for (int i = 0; i < options.phantoms; ++i) {
      organs.push_back({name, std::to_string(i), makePhantom(name, kUnseenPatients + i)});
    }
  }
  return organs;
}

/// Turns both clouds together: the problem stays the same, but the network was made for organs as
/// scanners lay them.
void turn(RegistrationPair& pair, double degrees, std::uint64_t seed) {
  const Eigen::Isometry3d rotation(
      Eigen::AngleAxisd(degrees * M_PI / 180.0, Random(seed).direction()));
  for (Points* points : {&pair.source, &pair.source_normals, &pair.target, &pair.truth}) {
    *points = rotation.linear().cast<float>() * *points;
  }
  pair.best_rigid = rotation * pair.best_rigid * rotation.inverse();
}

/// Sums over cases, printed as means.
struct Row {
  int cases = 0;
  int refused = 0;
  int worse = 0;
  RegistrationErrors sum;

  void add(const RegistrationErrors& errors) {
    ++cases;
    refused += errors.refused ? 1 : 0;
    worse += errors.final > errors.before ? 1 : 0;
    sum.before += errors.before;
    sum.best_rigid += errors.best_rigid;
    sum.rigid += errors.rigid;
    sum.final += errors.final;
    sum.pose_before += errors.pose_before;
    sum.pose += errors.pose;
    sum.rotation += errors.rotation;
    sum.translation += errors.translation;
  }

  void print(const std::string& name) const {
    const auto mm = [this](double metres) { return 1000.0 * metres / cases; };
    std::printf("| %s | %d | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f | %d | %d |\n",
                name.c_str(), cases, mm(sum.before), mm(sum.best_rigid), mm(sum.rigid),
                mm(sum.final), mm(sum.pose_before), mm(sum.pose), sum.rotation / cases,
                mm(sum.translation), worse, refused);
  }
};

void run(const Options& options) {
  const auto weights = std::make_shared<const Weights>(readWeights(options.weights));
  RegistrationSettings settings;
  settings.network.pairing = weights->pairing;
  settings.sampling.points = options.points;
  settings.threads = options.threads;
  Registrar registrar(weights, settings);
  const std::vector<Organ> organs = organsOf(options);
  if (organs.empty()) throw std::runtime_error("no organs: give --data FOLDER or --phantoms N");

  std::printf(
      "weights %s, start %s, %d points, seed %llu; means over cases, mm and degrees; "
      "`pose`: RMS distance to the best rigid fit\n",
      weights->sha256.c_str(), options.start.c_str(), options.points,
      static_cast<unsigned long long>(options.seed));
  for (const std::string& name : options.protocols) {
    const Protocol protocol = protocolFromString(name);
    std::map<std::string, Row> rows;
    for (const Organ& organ : organs) {
      for (int i = 0; i < options.pairs; ++i) {
        const auto& all = rows["all"];
        const std::uint64_t seed =
            options.seed * 1000003ULL + static_cast<std::uint64_t>(all.cases);
        RegistrationPair pair = makePair(organ.surface, protocol, options.points, seed);
        turn(pair, options.common_rotation, seed);
        const Eigen::Isometry3d start =
            options.start == "identity"
                ? Eigen::Isometry3d::Identity()
                : alignCentroids({pair.source, Points()}, {pair.target, Points()});
        const RegistrationErrors errors = registrationErrors(registrar, pair, start);
        rows[organ.name].add(errors);
        rows["all"].add(errors);
      }
    }
    std::printf(
        "\n%s\n\n| organ | cases | before | best rigid | rigid | final | pose before | pose | "
        "rotation | translation | worse | refused |\n"
        "|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        name.c_str());
    for (const auto& [organ, row] : rows) {
      if (organ != "all") row.print(organ);
    }
    rows["all"].print("**all**");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Registers pairs with known truth and prints a table of errors."};
  Options options;
  addOptions(app, options);
  try {
    app.parse(argc, argv);
    run(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::cerr << "unirit_benchmark: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
