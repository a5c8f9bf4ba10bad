// SPDX-License-Identifier: BSD-3-Clause
// Speed of the refinement, of the whole pipeline and of what they are compared with, on the same
// clouds: phantom organs (a liver where nothing is compared) under a random deformation, seen whole
// or from one side.
#include <algorithm>
#include <ctime>
#include <map>
#include <string>
#include <utility>

#include "refinement/coherent_field.hpp"
#include "refinement/refinement.hpp"
#include "speed.hpp"
#include "unirit/evaluation/method_factory.hpp"
#include "unirit/random.hpp"
#include "unirit/registration.hpp"
#include "unirit/sampling.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit::speed {
namespace {

constexpr Eigen::Index kDenseVertices = 200000;
constexpr Eigen::Index kCameraPoints = 100000;
constexpr int kCounted = 10;  // registrations of a pair a rival's processor time is compared with

const RegistrationPair& pairOf(Protocol protocol, const std::string& organ = "liver") {
  static std::map<std::pair<Protocol, std::string>, RegistrationPair> pairs;
  const auto known = pairs.find({protocol, organ});
  if (known != pairs.end()) return known->second;
  return pairs[{protocol, organ}] = makePair(makePhantom(organ, 1), protocol, kPoints, 1);
}

/// A refinement and what it is given, in the network's unit.
struct Problem {
  Problem(const RegistrationPair& registered, int threads)
      : pair(registered),
        normalisation(Normalisation::of(pair.source)),
        target{normalisation.apply(pair.target), {}},
        team(threads),
        refinement({normalisation.apply(pair.source), pair.source_normals}, {}, selectKernels(),
                   team) {
    if (pair.viewpoint) target.viewpoint = Points(normalisation.apply(*pair.viewpoint)).col(0);
  }

  Refined refine() { return refinement.refine(refinement.sight(target), start); }

  /// What makes a further refinement begin where this one ended, as from the view before.
  void beginAt(const Refined& refined) {
    const DisplacementPrior& prior = *refinement.prior();
    start = {refined.pose, prior.displacements(refinement.source().points, refined.coefficients),
             true};
  }

  const RegistrationPair& pair;
  Normalisation normalisation;
  PointCloud target;
  SearchStart start{Eigen::Isometry3f::Identity(), Points::Zero(3, kPoints)};
  ThreadTeam team;
  Refinement refinement;
};

/// From afar, with what belongs to the organ at hand.
void refineCold(benchmark::State& state, Protocol protocol) {
  Problem problem(pairOf(protocol), threadsOf(state));
  for (auto _ : state) benchmark::DoNotOptimize(problem.refine());
}

/// From the registration of the view before.
void refineWarm(benchmark::State& state, Protocol protocol) {
  Problem problem(pairOf(protocol), threadsOf(state));
  problem.beginAt(problem.refine());
  for (auto _ : state) benchmark::DoNotOptimize(problem.refine());
}

RegistrationSettings settingsOf(const benchmark::State& state) {
  RegistrationSettings settings;
  settings.threads = threadsOf(state);
  return settings;
}

/// Returns the first registration.
Registration registerClouds(benchmark::State& state, const PointCloud& preoperative,
                            const PointCloud& intraoperative, bool warm) {
  Registrar registrar(weights(NetworkSettings().pairing), settingsOf(state));
  const auto registerFrom = [&](const Eigen::Isometry3d& start, const Earlier* earlier) {
    return registrar.registerClouds(preoperative, intraoperative, start, earlier);
  };
  const Registration first = registerFrom(Eigen::Isometry3d::Identity(), nullptr);
  const Earlier earlier{first.T_intraoperative_preoperative, first.deformation, first.next_fit};
  for (auto _ : state) {
    benchmark::DoNotOptimize(warm ? registerFrom(earlier.T_intraoperative_preoperative, &earlier)
                                  : registerFrom(Eigen::Isometry3d::Identity(), nullptr));
  }
  return first;
}

/// Everything from two clouds to a registration that has been judged.
void pipeline(benchmark::State& state, Protocol protocol, bool warm) {
  const RegistrationPair& pair = pairOf(protocol);
  registerClouds(state, {pair.source, pair.source_normals}, {pair.target, {}, pair.viewpoint},
                 warm);
}

/// The same with points scattered about the organ, which no refinement fits: the network is run,
/// and the refinement again.
void pipelineAstray(benchmark::State& state) {
  const RegistrationPair& pair = pairOf(Protocol::kResampled);
  Random random(1);
  const Eigen::Vector3d corner = pair.source.rowwise().maxCoeff().cast<double>();
  Points scattered(3, kPoints);
  for (auto point : scattered.colwise()) {
    point = random.uniformVector(-corner, corner).cast<float>();
  }
  const Registration first =
      registerClouds(state, {pair.source, pair.source_normals}, {scattered, {}}, false);
  const bool ran = std::any_of(first.stages.begin(), first.stages.end(),
                               [](const StageTime& time) { return time.stage == "rigid"; });
  if (!ran) state.SkipWithError("the network was not run");
}

/// Everything with a camera's cloud and an organ's mesh.
void pipelineOfCamera(benchmark::State& state, bool warm) {
  const Surface organ = makePhantom("liver", 1, static_cast<int>(kVertices));
  const PointCloud seen{sampleByArea(organ, kCameraPoints, 1).points, {}};
  registerClouds(state, {organ.vertices.points, {}}, seen, warm);
}

/// Displacement and confidence of every vertex; `first`: of an organ not met before.
void dense(benchmark::State& state, bool first) {
  Problem problem(pairOf(Protocol::kPartial), threadsOf(state));
  const Refined refined = problem.refine();
  const DisplacementPrior& prior = *problem.refinement.prior();
  const CoherentField field(problem.refinement.prior(), problem.normalisation,
                            refined.pose.linear(), refined.coefficients, refined.covariance_factor);
  const Points vertices =
      problem.normalisation.apply(sampleByArea(makePhantom("liver", 1), kDenseVertices, 1).points);
  Eigen::MatrixXf functions = prior.functions(vertices, problem.team);
  for (auto _ : state) {
    if (first) functions = prior.functions(vertices, problem.team);
    benchmark::DoNotOptimize(field.valuesAt(functions, problem.team));
  }
}

double processorMilliseconds() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Processor time of one of our refinements [ms].
double timeOf(Problem& problem) {
  const double begin = processorMilliseconds();
  for (int i = 0; i < kCounted; ++i) benchmark::DoNotOptimize(problem.refine());
  return (processorMilliseconds() - begin) / kCounted;
}

/// A rival as tuned for the protocol, on a pair of each phantom organ: how long it takes depends on
/// when it converges. Shows its processor time over that of our refinement, from afar and from the
/// view before, in the same run.
void rival(benchmark::State& state, const std::string& name, Protocol protocol) {
  const auto method = MethodFactory("").make(name, protocol);
  double cold = 0.0, warm = 0.0;
  for (const std::string& organ : phantomOrgans()) {
    Problem problem(pairOf(protocol, organ), 1);
    const Refined refined = problem.refine();
    cold += timeOf(problem);
    problem.beginAt(refined);
    warm += timeOf(problem);
  }
  const double begin = processorMilliseconds();
  for (auto _ : state) {
    for (const std::string& organ : phantomOrgans()) {
      benchmark::DoNotOptimize(method->registerPair(pairOf(protocol, organ)));
    }
  }
  const double theirs = (processorMilliseconds() - begin) / static_cast<double>(state.iterations());
  state.counters["over_cold"] = theirs / cold;
  state.counters["over_warm"] = theirs / warm;
}

const bool registered = [] {
  const auto onThreads = [](benchmark::internal::Benchmark* entry) {
    entry->Arg(1)->Arg(2)->UseRealTime()->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);
  };
  const std::map<std::string, Protocol> sights{{"whole", Protocol::kResampled},
                                               {"view", Protocol::kPartial}};
  for (const auto& [sight, protocol] : sights) {
    onThreads(benchmark::RegisterBenchmark(("refine/cold/" + sight).c_str(), refineCold, protocol));
    onThreads(benchmark::RegisterBenchmark(("refine/warm/" + sight).c_str(), refineWarm, protocol));
    for (const bool warm : {false, true}) {
      const std::string name = std::string("pipeline/") + (warm ? "warm/" : "cold/") + sight;
      onThreads(benchmark::RegisterBenchmark(name.c_str(), pipeline, protocol, warm));
    }
  }
  onThreads(benchmark::RegisterBenchmark("pipeline/cold/astray", pipelineAstray));
  onThreads(benchmark::RegisterBenchmark("pipeline/cold/camera", pipelineOfCamera, false));
  onThreads(benchmark::RegisterBenchmark("pipeline/warm/camera", pipelineOfCamera, true));
  onThreads(benchmark::RegisterBenchmark("dense/first", dense, true));
  onThreads(benchmark::RegisterBenchmark("dense/again", dense, false));
  for (const std::string name : {"cpd", "bcpd"}) {
    for (const auto& [sight, protocol] : sights) {
      benchmark::RegisterBenchmark((name + "/" + sight).c_str(), rival, name, protocol)
          ->UseRealTime()
          ->MeasureProcessCPUTime()
          ->Unit(benchmark::kMillisecond);
    }
  }
  return true;
}();

}  // namespace
}  // namespace unirit::speed
