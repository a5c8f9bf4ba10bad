// SPDX-License-Identifier: BSD-3-Clause
// Command line of the training: organs in, weights out.
#include <malloc.h>
#include <stdlib.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <limits>
#include <map>
#include <thread>

#include "../atomic_file.hpp"
#include "trainer.hpp"
#include "unirit/evaluation/deformable_organs.hpp"
#include "unirit/simulation/anatomical_variation.hpp"
#include "unirit/simulation/phantom.hpp"

namespace {

using namespace unirit;            // NOLINT
using namespace unirit::training;  // NOLINT

constexpr double kMillimetre = 0.001;
constexpr int kPhantomVertices = 5000;

struct Options {
  std::vector<std::string> data;
  std::vector<std::string> exclude{"small_bowel"};
  int phantoms = 0;
  int hold_out = 12;
  int subjects = 0;
  std::string output;
  std::string start_from;
  std::string method = "unirit";
  std::string pairing = toString(NetworkSettings().pairing);
  std::string target = "resampled";
  std::string loss = "supervised";
  std::string device = "cpu";
  TrainingSettings training;
};

/// OpenBLAS 0.3.21 takes its slowest kernels on recent processors, four times slower, and its
/// threads would fight with the trainer's. It reads its environment before main, so the command
/// starts itself again with kernels and threads named.
void configureBlas(char** arguments) {
  if (getenv("OPENBLAS_NUM_THREADS") != nullptr) return;
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
                      __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  if (avx512 || __builtin_cpu_supports("avx2")) {
    setenv("OPENBLAS_CORETYPE", avx512 ? "SkylakeX" : "Haswell", 0);
  }
  execv("/proc/self/exe", arguments);  // returns only on failure; then training is merely slower
}

/// Every step asks for the tensors of the one before: what goes back to the kernel between them is
/// cleared page by page again, a fifth of a step's time.
void keepMemory() {
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  mallopt(M_TOP_PAD, 64 << 20);
}

void addOptions(CLI::App& app, Options& options) {
  auto& training = options.training;
  auto& batch = training.batch;
  app.add_option("--data", options.data, "Folder of organ surfaces, ORGAN/*.{ply,stl,obj,pcd}, mm");
  app.add_option("--exclude", options.exclude, "Organ classes never trained on")
      ->capture_default_str();
  app.add_option("--phantoms", options.phantoms, "Digital phantoms of each organ to train on too")
      ->check(CLI::Range(0, 10000));
  app.add_option("--subjects", options.subjects,
                 "Classes of fewer organs are filled up to this many with varied anatomies of "
                 "theirs")
      ->check(CLI::Range(0, 10000))
      ->capture_default_str();
  app.add_option("--hold-out", options.hold_out, "Every n-th organ of a class validates")
      ->check(CLI::Range(2, 1000000))
      ->capture_default_str();
  app.add_option("--output", options.output,
                 "Folder for checkpoint.pt, curves.csv and unirit.safetensors; a checkpoint found "
                 "there is resumed")
      ->required();
  app.add_option("--start-from", options.start_from, "Weights file to start from (else He)");
  app.add_option("--method", options.method,
                 "unirit, or fpt: the non-rigid module alone, without pairing (Free Point "
                 "Transformer)")
      ->check(CLI::IsMember({"unirit", "fpt"}))
      ->capture_default_str();
  app.add_option("--pairing", options.pairing,
                 "offsets: the flow module; nearest, none or row: the published modules")
      ->capture_default_str();
  app.add_option("--target", options.target,
                 "What the target's points are: resampled on the deformed surface, or paired, the "
                 "source's own in their order (only to reproduce published tables)")
      ->check(CLI::IsMember({"resampled", "paired"}))
      ->capture_default_str();
  app.add_option("--loss", options.loss, "supervised or paper")
      ->check(CLI::IsMember({"supervised", "paper"}))
      ->capture_default_str();
  app.add_option("--alpha", training.alpha,
                 "Weight of the global loss in the loss shown; 0 trains by the rigid stage alone, 1 "
                 "by the non-rigid stage alone")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--iterations", training.iterations, "Rigid iterations while training")
      ->check(CLI::Range(1, 32))
      ->capture_default_str();
  app.add_option("--decoded-points", training.decoded_points,
                 "Points of each pair whose displacement the published non-rigid module learns "
                 "from; the flow module learns from all")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--steps", training.steps)->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--rigid-steps", training.rigid_steps,
                 "The first of them, that train by the rigid stage alone")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--batch", batch.pairs, "Pairs a step")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--points", batch.points, "Points of each cloud")
      ->check(CLI::Range(8, 1200))
      ->capture_default_str();
  app.add_option("--partial-share", batch.partial_share, "Share of pairs seen from one side")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--near-share", batch.near_share,
                 "Share of pairs with neither rotation nor translation between the clouds")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--pairs-per-deformation", batch.pairs_per_deformation,
                 "Views of each deformed organ")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--rotation", batch.rotation, "Between the clouds, at most [degree]")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  app.add_option("--common-rotation", batch.common_rotation, "Of both clouds, at most [degree]")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  app.add_option("--learning-rate", training.learning_rate)
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--report-every", training.report_every, "Steps between lines")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--save-every", training.save_every, "Steps between checkpoints")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seed", training.seed)->capture_default_str();
  training.threads = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  app.add_option("--threads", training.threads, "Parts of a batch computed at once")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--data-threads", training.data_threads, "Threads that make pairs")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--device", options.device, "cpu or cuda")
      ->check(CLI::IsMember({"cpu", "cuda"}))
      ->capture_default_str();
}

std::vector<Organ> organsOf(const Options& options) {
  std::vector<Organ> organs;
  for (const std::string& folder : options.data) {
    for (Organ& organ : readDeformableOrgans(
             folder, kMillimetre, options.exclude,
             [](const auto& sentence) { std::cerr << "left out: " << sentence << '\n'; })) {
      organs.push_back(std::move(organ));
    }
  }
  for (int i = 0; i < options.phantoms; ++i) {
    for (const std::string& name : phantomOrgans()) {
      const std::uint64_t patient =
          options.training.seed * 100000ULL + static_cast<std::uint64_t>(i);
      organs.push_back({"phantom_" + name, std::to_string(patient),
                        makePhantom(name, patient, kPhantomVertices)});
    }
  }
  if (organs.empty()) throw std::runtime_error("no organs: give --data FOLDER or --phantoms N");
  return organs;
}

/// Every n-th organ of a class is held out, if the class has as many.
std::pair<std::vector<Organ>, std::vector<Organ>> split(std::vector<Organ> organs, int every) {
  std::map<std::string, int> seen;
  std::vector<Organ> kept, held_out;
  for (Organ& organ : organs) {
    const bool validates = ++seen[organ.name] % every == 0;
    (validates ? held_out : kept).push_back(std::move(organ));
  }
  if (held_out.empty()) held_out.push_back(kept.back());
  return {std::move(kept), std::move(held_out)};
}

/// Classes of fewer than `least` organs get varied anatomies of theirs, in turn.
void fillUp(std::vector<Organ>& organs, int least, std::uint64_t seed) {
  std::map<std::string, std::vector<Organ>> classes;
  for (const Organ& organ : organs) classes[organ.name].push_back(organ);
  for (const auto& [name, originals] : classes) {
    for (auto i = originals.size(); i < static_cast<std::size_t>(least); ++i) {
      const Organ& original = originals[i % originals.size()];
      organs.push_back({name, original.subject + " variation " + std::to_string(i),
                        varyAnatomy(original.surface, seed + i)});
    }
  }
}

void printProgress(const Progress& p) {
  std::printf("step %ld/%ld  loss %.4f ", static_cast<long>(p.step), static_cast<long>(p.steps),
              p.loss);
  for (const ValidationErrors& errors : p.validation) {
    std::printf(" %s %.1f, %.1f mm ", toString(errors.protocol), 1000.0 * errors.rigid,
                1000.0 * errors.final);
  }
  std::printf(" %.0f pairs/s  lr %.1e  %.0f s, %.0f s left\n", p.pairs_per_second, p.learning_rate,
              p.seconds, p.seconds_left);
  std::fflush(stdout);
}

void run(Options& options) {
  TrainingSettings& training = options.training;
  if (options.method == "fpt") {
    options.pairing = "none";
    training.alpha = 1.0;
  }
  training.pairing = pairingFromString(options.pairing);
  if (options.target == "paired") training.batch.target = View::Target::kPaired;
  training.loss = options.loss == "paper" ? Loss::kPaper : Loss::kSupervised;
  training.device = torch::Device(options.device);
  if (training.device.is_cuda() && !torch::cuda::is_available()) {
    throw std::runtime_error("--device cuda: this LibTorch or machine has no CUDA device");
  }
  if (training.device.is_cuda()) {
    training.threads = 1;
    at::globalContext().setAllowTF32CuBLAS(true);  // ten mantissa bits, several times as fast
  }
  if (training.threads > 1) torch::set_num_threads(1);
  const std::filesystem::path output = options.output;
  requirePlaceFor((output / "unirit.safetensors").string());
  Unirit model(training.pairing);
  model->setWeights(randomWeights(training.pairing, static_cast<unsigned>(training.seed)));
  if (!options.start_from.empty()) model->setWeights(readWeights(options.start_from));
  auto [organs, validation] = split(organsOf(options), options.hold_out);
  fillUp(organs, options.subjects, training.seed);
  std::printf("training on %zu organs, validating on %zu\n", organs.size(), validation.size());
  std::printf(
      "of every validation protocol: rigid stage to the best rigid fit, final to the truth\n");
  std::fflush(stdout);

  Progress last;
  model = train(organs, validation, training, output, model, [&](const Progress& progress) {
    printProgress(progress);
    last = progress;
  });

  Weights weights = model->weights();
  weights.metadata["training_steps"] = std::to_string(training.steps);
  weights.metadata["training_organs"] = std::to_string(organs.size());
  weights.metadata["training_seed"] = std::to_string(training.seed);
  weights.metadata["loss"] = options.loss;
  for (const ValidationErrors& errors : last.validation) {
    const std::string name = std::string("validation_") + toString(errors.protocol);
    weights.metadata[name + "_rigid_mm"] = std::to_string(1000.0 * errors.rigid);
    weights.metadata[name + "_final_mm"] = std::to_string(1000.0 * errors.final);
  }
  const std::filesystem::path path = output / "unirit.safetensors";
  writeWeights(weights, path);
  std::printf("wrote %s\n", path.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  configureBlas(argv);
  keepMemory();
  CLI::App app{"Trains the UniRiT network and writes its weights as safetensors."};
  Options options;
  addOptions(app, options);
  try {
    app.parse(argc, argv);
    run(options);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::cerr << "unirit_train: " << error.what() << '\n';
    return 2;
  }
  return 0;
}
