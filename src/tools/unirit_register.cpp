// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "register_options.hpp"
#include "unirit/io/result_json.hpp"
#include "unirit/io/settings_yaml.hpp"
#include "unirit/io/surface_io.hpp"
#include "unirit/normals.hpp"
#include "unirit/preprocessing.hpp"
#include "unirit/registration.hpp"
#include "unirit/sampling.hpp"

namespace unirit {
namespace {

namespace fs = std::filesystem;

enum ExitStatus { kRegistered = 0, kInternalFailure = 1, kUnusable = 2, kRefused = 3 };

/// The model that comes with the package: beside the installed tool, or in the source tree.
std::string packagedWeights() {
  const fs::path model = fs::path("models") / "unirit.safetensors";
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  const fs::path installed = (folder / "../../share/unirit" / model).lexically_normal();
  return (fs::exists(installed) ? installed : fs::path(UNIRIT_SOURCE_DIR) / model).string();
}

/// Everything read and checked; nothing written yet.
struct Job {
  std::shared_ptr<const Weights> weights;
  RegistrationSettings settings;
  SurfaceFile preoperative;
  SurfaceFile intraoperative;
  std::optional<Points> points;
};

Job prepare(const RegisterOptions& options) {
  Job job;
  job.weights = std::make_shared<const Weights>(
      readWeights(options.weights.empty() ? packagedWeights() : options.weights));
  job.settings.network.pairing = job.weights->pairing;
  if (!options.settings.empty()) readSettings(options.settings, job.settings);
  if (!options.stages.empty()) job.settings.stages = stagesFromString(options.stages);
  if (!options.correspondence.empty()) {
    job.settings.refinement.correspondence = correspondenceFromString(options.correspondence);
  }
  if (options.threads) job.settings.threads = *options.threads;
  validate(job.settings);
  job.preoperative = readSurface(options.preoperative, options.unit);
  job.intraoperative = readSurface(options.intraoperative, options.unit);
  if (options.viewpoint) job.intraoperative.viewpoint = options.viewpoint;
  if (!options.points.empty()) {
    const SurfaceFile file = readSurface(options.points, options.unit);
    if (file.dropped > 0) {
      throw std::runtime_error("--points \"" + options.points +
                               "\" has points that are not finite");
    }
    job.points = file.surface.vertices.points;
  }
  if (fs::exists(options.output) && !fs::is_directory(options.output)) {
    throw std::runtime_error("--output \"" + options.output + "\" is not a folder");
  }
  return job;
}

/// The vertices, followed by points on the faces where the vertices alone are too coarse. Normals
/// are those of the faces; a bare cloud keeps its own.
PointCloud cloudOf(const SurfaceFile& file, int sampled_points, std::uint64_t seed) {
  constexpr Eigen::Index kDensity = 4;  // points for each one that the network is given
  Surface surface = file.surface;
  PointCloud& cloud = surface.vertices;
  cloud.viewpoint = file.viewpoint;
  if (surface.faces.cols() == 0) return cloud;
  turnFacesOutwards(surface);
  cloud.normals = vertexNormals(surface);
  const Eigen::Index vertices = cloud.size(), wanted = kDensity * sampled_points;
  if (vertices < wanted) {
    const PointCloud samples = sampleByArea(surface, wanted, seed);
    cloud.points.conservativeResize(Eigen::NoChange, vertices + wanted);
    cloud.normals.conservativeResize(Eigen::NoChange, vertices + wanted);
    cloud.points.rightCols(wanted) = samples.points;
    cloud.normals.rightCols(wanted) = samples.normals;
  }
  // Vertices without a face have none: then all are estimated
  if ((cloud.normals.colwise().squaredNorm().array() == 0.0F).any()) cloud.normals.resize(3, 0);
  return cloud;
}

/// What came of a job, and of the points of its intra-operative file.
struct Outcome {
  std::vector<StagePoints> preprocessing;
  Registration registration;
};

Outcome registerSurfaces(const Job& job, const RegisterOptions& options) {
  const int points = job.settings.sampling.points;
  const PointCloud preoperative = cloudOf(job.preoperative, points, options.seed);
  RawCloud raw{cloudOf(job.intraoperative, points, options.seed + 1)};
  raw.received = raw.cloud.size() + job.intraoperative.dropped;
  if (options.region) raw.region = Region{*options.region, Eigen::Isometry3d::Identity()};
  const Preprocessed ready = preprocess(std::move(raw), preoperative.points, job.settings);
  if (ready.fault) throw std::runtime_error(*ready.fault);
  return {ready.stages, Registrar(job.weights, job.settings)
                            .registerClouds(preoperative, ready.cloud,
                                            alignCentroids(preoperative, ready.cloud))};
}

void openFolder(const std::string& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (::access(folder.c_str(), W_OK) != 0) {
    throw std::runtime_error("--output \"" + folder + "\" is not a folder that can be written to");
  }
}

void writeResults(const Job& job, const Outcome& outcome, const RegisterOptions& options) {
  const auto path = [&](const char* name) { return (fs::path(options.output) / name).string(); };
  const Points& vertices = job.preoperative.surface.vertices.points;
  const Deformation& deformation = *outcome.registration.deformation;
  Surface moved{{deformation.moveRigidly(vertices), {}}, job.preoperative.surface.faces};
  writePly(moved, path("rigid.ply"), options.unit);
  moved.vertices.points = deformation.movedSurface().leftCols(vertices.cols());
  writePly(moved, path("deformed.ply"), options.unit);
  if (job.points) {
    writePly({{deformation.move(*job.points), {}}, {}}, path("points.ply"), options.unit);
  }

  std::ofstream result(path("result.json"));
  result << toJson(
      outcome.registration,
      {fs::path(options.preoperative).filename().string(),
       fs::path(options.intraoperative).filename().string(), "centroids", outcome.preprocessing,
       job.settings.plausibility.inlier_tolerance, job.weights->sha256, sha256(job.settings)});
  result.close();
  if (!result) throw std::runtime_error("Cannot write \"" + path("result.json") + "\".");
}

void report(const Job& job, const Registration& registration, const std::string& folder) {
  for (const SurfaceFile* file : {&job.preoperative, &job.intraoperative}) {
    if (file->dropped == 0) continue;
    std::cout << file->dropped << " points of the "
              << (file == &job.preoperative ? "pre-operative" : "intra-operative")
              << " file are not finite and were left out\n";
  }
  std::cout << toString(registration.status) << ": " << registration.message
            << "; surface residual " << 1e3 * registration.residual.rms << " mm, displacement "
            << 1e3 * registration.displacement.rms << " mm (RMS); results in " << folder << "\n";
}

int fail(ExitStatus status, const std::string& sentence) {
  std::cerr << "unirit_register: " << sentence << "\n";
  return status;
}

int run(const RegisterOptions& options) {
  Job job;
  Outcome outcome;
  const Registration& registration = outcome.registration;
  try {
    job = prepare(options);
    outcome = registerSurfaces(job, options);
    if (registration.status == Status::kInvalidInput)
      throw std::runtime_error(registration.message);
    if (registration.deformation) openFolder(options.output);
  } catch (const std::exception& error) {
    return fail(kUnusable, error.what());
  }
  if (!registration.deformation) return fail(kInternalFailure, registration.message);
  writeResults(job, outcome, options);
  report(job, registration, options.output);
  return registration.succeeded() ? kRegistered : kRefused;
}

}  // namespace
}  // namespace unirit

int main(int argc, char** argv) {
  const auto parsed = unirit::parseRegisterOptions(argc, argv);
  if (parsed.exit_status) return *parsed.exit_status;
  try {
    return unirit::run(parsed.options);
  } catch (const std::exception& error) {
    return unirit::fail(unirit::kInternalFailure, error.what());
  }
}
