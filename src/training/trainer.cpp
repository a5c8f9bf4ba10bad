// SPDX-License-Identifier: BSD-3-Clause
#include "trainer.hpp"

#include <chrono>
#include <cmath>
#include <future>
#include <stdexcept>

#include "checkpoint.hpp"
#include "curves.hpp"
#include "surroundings.hpp"

namespace unirit::training {
namespace {

constexpr double kFinalRate = 0.01;       // of the first learning rate
constexpr double kGrowthShare = 0.3;      // of the steps, over which iterations and steps grow
constexpr double kWarmUpSteps = 200.0;    // the learning rate rises from zero
constexpr double kLargestGradient = 1.0;  // norm, over a module's parameters
constexpr double kAstray = 2.0;           // RMS from the truth from which a pair starts again
constexpr int kValidationIterations = 8;
constexpr std::int64_t kValidationPairs = 2;  // an organ
constexpr std::int64_t kValidationPoints = 1024;
constexpr std::int64_t kValidationChunk = 8;

/// sqrt of the mean over points, [B, N, 3] -> [B].
torch::Tensor rootMeanSquare(const torch::Tensor& offsets) {
  return (offsets.square().sum(2).mean(1) + 1e-12).sqrt();
}

torch::Tensor distance(Loss loss, const torch::Tensor& moved, const torch::Tensor& truth,
                       const torch::Tensor& target) {
  if (loss == Loss::kSupervised) return rootMeanSquare(moved - truth).mean();
  return rootMeanSquare(offsets(moved, target)).mean();
}

template <class Function>
Batch transformed(const Batch& batch, Function&& function) {
  return {function(batch.source), function(batch.start), function(batch.target),
          function(batch.truth),  function(batch.rigid), function(batch.scale)};
}

Batch slice(const Batch& batch, std::int64_t first, std::int64_t last) {
  return transformed(batch, [&](const torch::Tensor& t) { return t.slice(0, first, last); });
}

/// Iterations, or steps along the flow, grow from one to all: weights that have learnt little would
/// lead far away.
int grown(int all, const TrainingSettings& settings, std::int64_t step) {
  const double growth = static_cast<double>(step) / (kGrowthShare * settings.steps);
  return std::min(all, 1 + static_cast<int>(growth * all));
}

struct Outcome {
  torch::Tensor loss;
  torch::Tensor moved;  // the source, detached; undefined where nothing follows
};

/// One pass of the rigid or the non-rigid stage from where batch.source stands, and its loss. That
/// of the published non-rigid module is taken at some points of each pair: its decoder is most of
/// the work.
Outcome pass(Unirit& model, const Batch& batch, const TrainingSettings& settings, Stage stage) {
  const bool rigid = stage == Stage::kRigid;
  if (model->flow) {
    const auto moved = batch.source + model->flow->forward(batch.start, batch.source, batch.target);
    return {distance(settings.loss, moved, batch.truth, batch.target), moved.detach()};
  }
  if (rigid) {
    torch::Tensor target_feature;
    const auto moved =
        model->rigid->forward(batch.source, batch.target, target_feature).apply(batch.source);
    return {distance(settings.loss, moved, batch.rigid, batch.target), moved.detach()};
  }
  const std::int64_t points = std::min(settings.decoded_points, batch.source.size(1));
  const auto moved = batch.source.slice(1, 0, points) +
                     model->nonrigid->forward(batch.source, batch.target, points);
  return {distance(settings.loss, moved, batch.truth.slice(1, 0, points), batch.target), {}};
}

/// Calls `work` with the number, first and last pair of each part of a batch, at once. On the CPU
/// every thread runs forward and backward alone: small layers gain more from that than from threads
/// inside every operation.
template <class Work>
void forEachPart(std::int64_t pairs, std::int64_t parts, const Work& work) {
  std::vector<std::future<void>> others;  // hand on what is thrown
  for (std::int64_t part = 1; part < parts; ++part) {
    others.push_back(std::async(std::launch::async, work, part, part * pairs / parts,
                                (part + 1) * pairs / parts));
  }
  work(0, 0, pairs / parts);
  for (std::future<void>& other : others) other.get();
}

/// Updates a stage's weights by one pass over the batch, moves the batch's source by it and returns
/// the loss.
torch::Tensor update(Unirit& model, torch::optim::Adam& optimiser, Batch& batch,
                     const TrainingSettings& settings, Stage stage) {
  const auto parameters = model->parameters();
  const std::int64_t pairs = batch.source.size(0);
  const std::int64_t parts = std::min<std::int64_t>(settings.threads, pairs);
  std::vector<torch::Tensor> losses(static_cast<std::size_t>(parts)), moved(losses.size());
  std::vector<torch::autograd::variable_list> gradients(losses.size());
  forEachPart(pairs, parts, [&](std::int64_t part, std::int64_t first, std::int64_t last) {
    const double share = static_cast<double>(last - first) / static_cast<double>(pairs);
    const Outcome outcome = pass(model, slice(batch, first, last), settings, stage);
    const auto loss = share * outcome.loss;
    const auto slot = static_cast<std::size_t>(part);
    losses[slot] = loss.detach();
    moved[slot] = outcome.moved;
    gradients[slot] = torch::autograd::grad({loss}, parameters, {}, {}, false, true);
  });
  if (moved.front().defined()) {
    const auto reached = torch::cat(moved);
    const auto near = (rootMeanSquare(reached - batch.truth) < kAstray).view({-1, 1, 1});
    batch.source = torch::where(near, reached, batch.start);
  }

  for (std::size_t i = 0; i < parameters.size(); ++i) {
    auto& sum = parameters[i].mutable_grad();
    sum = gradients.front()[i];  // undefined in the other module: left as it is
    if (!sum.defined()) continue;
    for (std::size_t part = 1; part < gradients.size(); ++part) sum.add_(gradients[part][i]);
  }
  torch::nn::utils::clip_grad_norm_(parameters, kLargestGradient);
  optimiser.step();
  return torch::stack(losses).sum();
}

/// So many updates, each on the output of the one before, and the mean of their losses.
torch::Tensor updates(int passes, Unirit& model, torch::optim::Adam& optimiser, Batch& batch,
                      const TrainingSettings& settings, Stage stage) {
  torch::Tensor loss = torch::zeros({}, batch.source.options());
  for (int i = 0; i < passes; ++i) loss += update(model, optimiser, batch, settings, stage);
  return loss / passes;
}

/// The iterations of the rigid stage by flow: all but the last are coarse. Only those need the
/// order of the coordinates, to choose points; elsewhere random ones serve for the coherent way as
/// well.
torch::Tensor learnRigidFlow(Unirit& model, torch::optim::Adam& optimiser, Batch& batch,
                             const TrainingSettings& settings, std::int64_t step) {
  torch::Tensor loss = torch::zeros({}, batch.source.options());
  const int iterations = grown(settings.iterations, settings, step);
  const auto source = coarseOrder(batch.source), target = coarseOrder(batch.target);
  for (int i = 0; i < iterations; ++i) {
    const bool fine = i + 1 == iterations;
    Batch read = batch;
    if (!fine) {
      read.source = read.start = ordered(batch.source, source);
      read.target = ordered(batch.target, target);
      read.truth = ordered(batch.truth, source);
    }
    const int steps = grown(fine ? kFlowFineSteps : kFlowCoarseSteps, settings, step);
    loss += updates(steps, model, optimiser, read, settings, Stage::kRigid);
    batch.source = batch.start = bestRigidFit(read.start, read.source).apply(batch.start);
  }
  return loss / iterations;
}

/// One step: an update for every iteration of the rigid stage, by flow for every step of it, each
/// on the output of the one before, so that it has seen what it will be given, then those of the
/// non-rigid stage. What passes between them is detached and Adam does not see a loss's scale, so
/// alpha between 0 and 1 weighs only what is returned, the paper's L_total.
torch::Tensor learn(Unirit& model, torch::optim::Adam& optimiser, Batch batch,
                    const TrainingSettings& settings, std::int64_t step) {
  const double alpha = step < settings.rigid_steps ? 0.0 : settings.alpha;
  torch::Tensor loss = torch::zeros({}, batch.source.options());
  if (alpha < 1.0) {
    loss +=
        (1.0 - alpha) * (model->flow ? learnRigidFlow(model, optimiser, batch, settings, step)
                                     : updates(grown(settings.iterations, settings, step), model,
                                               optimiser, batch, settings, Stage::kRigid));
  }
  if (alpha > 0.0) {
    const int steps = model->flow ? grown(kFlowNonRigidSteps, settings, step) : 1;
    loss += alpha * updates(steps, model, optimiser, batch, settings, Stage::kNonRigid);
  }
  return loss;
}

struct ValidationSet {
  Protocol protocol;
  Batch pairs;
};

std::vector<Protocol> validationProtocols(const TrainingSettings& settings) {
  if (settings.batch.target == View::Target::kPaired) return {Protocol::kPaired};
  return {Protocol::kCaseB, Protocol::kResampled, Protocol::kPartial, Protocol::kIntraop};
}

std::vector<ValidationSet> validationSets(const std::vector<Organ>& organs,
                                          const TrainingSettings& settings) {
  std::vector<ValidationSet> sets;
  for (const Protocol protocol : validationProtocols(settings)) {
    sets.push_back({protocol, makeValidation(organs, protocol, kValidationPairs, kValidationPoints,
                                             settings.seed)});
  }
  return sets;
}

ValidationErrors validate(Unirit& model, const ValidationSet& set,
                          const TrainingSettings& settings) {
  const Batch& all = set.pairs;
  const torch::NoGradGuard no_grad;
  double rigid = 0.0, final = 0.0;
  const std::int64_t count = all.source.size(0);
  for (std::int64_t first = 0; first < count; first += kValidationChunk) {
    const Batch part = transformed(slice(all, first, std::min(first + kValidationChunk, count)),
                                   [&](const torch::Tensor& t) { return t.to(settings.device); });
    const auto moved = model->moveRigidly(part.source, part.target,
                                          settings.alpha < 1.0 ? kValidationIterations : 0);
    rigid += (rootMeanSquare(moved - part.rigid) * part.scale).sum().item<double>();
    const auto deformed = model->deform(moved, part.target);
    final += (rootMeanSquare(deformed - part.truth) * part.scale).sum().item<double>();
  }
  return {set.protocol, rigid / static_cast<double>(count), final / static_cast<double>(count)};
}

double learningRate(const TrainingSettings& settings, std::int64_t step) {
  const double progress = static_cast<double>(step) / static_cast<double>(settings.steps);
  const double cosine = kFinalRate + (1.0 - kFinalRate) * (1.0 + std::cos(M_PI * progress)) / 2.0;
  return settings.learning_rate * cosine *
         std::min(1.0, (static_cast<double>(step) + 1.0) / kWarmUpSteps);
}

}  // namespace

Unirit train(const std::vector<Organ>& organs, const std::vector<Organ>& validation,
             const TrainingSettings& settings, const std::filesystem::path& folder, Unirit model,
             const std::function<void(const Progress&)>& report) {
  std::filesystem::create_directories(folder);
  model->to(settings.device);
  torch::optim::Adam optimiser(model->parameters(), settings.learning_rate);
  const Checkpoint checkpoint(folder);
  std::int64_t step = 0;
  double seconds_before = 0.0;
  const bool resumed = checkpoint.load(model, optimiser, step, seconds_before);
  const auto validation_sets = validationSets(validation, settings);
  Curves curves(folder / "curves.csv", resumed, validationProtocols(settings));
  BatchQueue queue(organs, settings.batch, settings.seed, step, settings.data_threads);

  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  auto since = start;
  const auto elapsed = [](Clock::time_point from) {
    return std::chrono::duration<double>(Clock::now() - from).count();
  };
  torch::Tensor loss_sum = torch::zeros({}, settings.device);  // read in reports alone
  std::int64_t since_step = step;
  while (step < settings.steps) {
    for (auto& group : optimiser.param_groups()) {
      static_cast<torch::optim::AdamOptions&>(group.options()).lr(learningRate(settings, step));
    }
    loss_sum += learn(
        model, optimiser,
        transformed(queue.next(), [&](const torch::Tensor& t) { return t.to(settings.device); }),
        settings, step);
    ++step;

    if (step % settings.report_every == 0 || step == settings.steps) {
      Progress progress;
      progress.step = step;
      progress.steps = settings.steps;
      progress.seconds = seconds_before + elapsed(start);
      const double per_step = elapsed(since) / static_cast<double>(step - since_step);
      progress.seconds_left = per_step * static_cast<double>(settings.steps - step);
      progress.pairs_per_second = static_cast<double>(settings.batch.pairs) / per_step;
      progress.learning_rate = learningRate(settings, step - 1);
      progress.loss = loss_sum.item<double>() / static_cast<double>(step - since_step);
      for (const ValidationSet& set : validation_sets) {
        progress.validation.push_back(validate(model, set, settings));
      }
      curves.append(progress);
      report(progress);
      if (!std::isfinite(progress.loss)) {
        throw std::runtime_error("training diverged: the loss is not finite");
      }
      loss_sum.zero_();
      since = Clock::now();
      since_step = step;
    }
    if (step % settings.save_every == 0 || step == settings.steps) {
      checkpoint.save(model, optimiser, step, seconds_before + elapsed(start));
    }
  }
  return model;
}

}  // namespace unirit::training
