// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/case_folder.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <tuple>

#include "unirit/io/organ_names.hpp"
#include "unirit/io/surface_io.hpp"
#include "unirit/metrics.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr double kMillimetre = 0.001;
constexpr double kRoundingMillimetres = 0.01;  // of coordinates in single precision

[[noreturn]] void fail(const fs::path& path, const std::string& clause) {
  throw std::runtime_error("Cannot read \"" + path.string() + "\": " + clause + ".");
}

PointCloud readCloud(const fs::path& path) {
  const SurfaceFile file = readSurface(path.string(), kMillimetre);
  if (file.dropped > 0) fail(path, "it has points that are not finite");
  return file.surface.vertices;
}

/// Rows of the two files are the same points before and after.
void requireSameLength(const Points& points, const Points& truth, const fs::path& truth_path) {
  if (points.cols() != truth.cols()) {
    fail(truth_path, "it holds " + std::to_string(truth.cols()) + " points where " +
                         std::to_string(points.cols()) + " are to be found again");
  }
}

Json readCaseJson(const fs::path& path) {
  std::ifstream file(path);
  if (!file) fail(path, "it is missing");
  Json json = Json::parse(file, nullptr, false);
  if (!json.is_object()) fail(path, "it is not a JSON object");
  return json;
}

std::optional<Eigen::Vector3f> viewpointOf(const Json& json, const fs::path& path) {
  const auto entry = json.find("viewpoint");
  if (entry == json.end()) fail(path, "it has no \"viewpoint\"");
  if (entry->is_null()) return std::nullopt;
  const bool valid =
      entry->is_array() && entry->size() == 3 &&
      std::all_of(entry->begin(), entry->end(), [](const Json& n) { return n.is_number(); });
  if (!valid) fail(path, "its \"viewpoint\" is neither null nor three numbers");
  Eigen::Vector3d viewpoint;
  for (int axis = 0; axis < 3; ++axis) viewpoint[axis] = (*entry)[axis].get<double>();
  return (kMillimetre * viewpoint).cast<float>();
}

void requireStatedError(const Json& json, const RegistrationPair& pair, const fs::path& path) {
  const auto entry = json.find("rmse_before_mm");
  if (entry == json.end() || !entry->is_number()) fail(path, "it has no number \"rmse_before_mm\"");
  const double stated = entry->get<double>();
  const double found = rootMeanSquareDistance(pair.source, pair.truth) / kMillimetre;
  if (!(std::abs(stated - found) <= kRoundingMillimetres + 1e-4 * found)) {
    fail(path, "it says rmse_before_mm " + std::to_string(stated) + ", source and truth say " +
                   std::to_string(found) + ": their rows do not belong together");
  }
}

}  // namespace

std::vector<CaseFolder> listCaseFolders(const std::string& root) {
  if (!fs::is_directory(root)) throw std::runtime_error("\"" + root + "\" is not a folder.");
  std::vector<CaseFolder> cases;
  for (const auto& protocol : fs::directory_iterator(root)) {
    if (!protocol.is_directory()) continue;
    for (const auto& entry : fs::directory_iterator(protocol)) {
      if (!fs::exists(entry.path() / "case.json")) continue;
      const auto [organ, subject] = splitOrganAndSubject(entry.path().filename().string());
      cases.push_back({protocol.path().filename().string(), organ, subject, entry.path().string()});
    }
  }
  if (cases.empty()) {
    throw std::runtime_error("\"" + root + "\" holds no case PROTOCOL/ORGAN_SUBJECT/case.json.");
  }
  std::sort(cases.begin(), cases.end(), [](const CaseFolder& a, const CaseFolder& b) {
    return std::tie(a.protocol, a.organ, a.subject) < std::tie(b.protocol, b.organ, b.subject);
  });
  return cases;
}

RegistrationPair readCaseFolder(const std::string& path) {
  const fs::path folder(path);
  const Json json = readCaseJson(folder / "case.json");
  RegistrationPair pair;
  pair.viewpoint = viewpointOf(json, folder / "case.json");
  const PointCloud source = readCloud(folder / "source.ply");
  if (source.normals.cols() != source.size()) fail(folder / "source.ply", "it has no normals");
  pair.source = source.points;
  pair.source_normals = source.normals;
  pair.target = readCloud(folder / "target.ply").points;
  pair.truth = readCloud(folder / "truth.ply").points;
  requireSameLength(pair.source, pair.truth, folder / "truth.ply");
  requireStatedError(json, pair, folder / "case.json");
  pair.interior = readCloud(folder / "points.ply").points;
  pair.interior_truth = readCloud(folder / "points_truth.ply").points;
  requireSameLength(pair.interior, pair.interior_truth, folder / "points_truth.ply");
  pair.surface = readCloud(folder / "surface.ply").points;
  pair.best_rigid = bestRigidFit(pair.source, pair.truth);
  return pair;
}

}  // namespace unirit
