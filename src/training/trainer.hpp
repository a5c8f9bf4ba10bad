// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "batch.hpp"
#include "model.hpp"

namespace unirit::training {

enum class Loss {
  kSupervised,  ///< RMS to the true position (published rigid module: to the best rigid fit's)
  kPaper,       ///< one-sided nearest-neighbour RMS, the paper's L_gl and L_rd
};

struct TrainingSettings {
  BatchSettings batch;
  Pairing pairing = NetworkSettings().pairing;
  Loss loss = Loss::kSupervised;
  double alpha = 0.5;  ///< weight of L_gl in the paper's L_total; 0 and 1 leave a stage out
  int iterations = 4;  ///< of the rigid stage while training, grown from 1
  std::int64_t decoded_points = 64;  ///< of each pair, whose displacement is learnt from
  double learning_rate = 5e-4;       ///< Adam's; falls to a hundredth along a cosine
  std::int64_t steps = 20000;
  std::int64_t rigid_steps = 0;  ///< of them, the first ones, that train by the rigid stage alone
  std::int64_t report_every = 100;
  std::int64_t save_every = 500;
  std::uint64_t seed = 1;
  int threads = 1;       ///< parts of a batch computed at once; 1 leaves threads to LibTorch
  int data_threads = 1;  ///< that make pairs
  torch::Device device = torch::kCPU;
};

/// Errors on the pairs of a protocol, averaged over pairs.
struct ValidationErrors {
  Protocol protocol = Protocol::kCaseB;
  double rigid = 0.0;  ///< rigid stage's output to the best rigid fit, RMS [m]
  double final = 0.0;  ///< whole network's output to the truth, RMS [m]
};

/// What a line of the curves says.
struct Progress {
  std::int64_t step = 0;
  std::int64_t steps = 0;
  double seconds = 0.0;       ///< since training began, over all its runs
  double seconds_left = 0.0;  ///< at the present speed
  double pairs_per_second = 0.0;
  double learning_rate = 0.0;
  double loss = 0.0;  ///< the network's unit
  std::vector<ValidationErrors> validation;
};

/// Trains on `organs`; validates on `validation` under `caseb`, `resampled`, `partial` and
/// `intraop`, or under `paired` where the targets in training are. Saves network, optimiser and
/// step to `folder`/checkpoint.pt and goes on from there if it exists; curves go to
/// `folder`/curves.csv. Throws std::runtime_error where the folder cannot be written or the
/// checkpoint does not fit.
Unirit train(const std::vector<Organ>& organs, const std::vector<Organ>& validation,
             const TrainingSettings& settings, const std::filesystem::path& folder, Unirit model,
             const std::function<void(const Progress&)>& report);

}  // namespace unirit::training
