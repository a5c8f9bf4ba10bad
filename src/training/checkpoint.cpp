// SPDX-License-Identifier: BSD-3-Clause
#include "checkpoint.hpp"

#include <stdexcept>

namespace unirit::training {

void Checkpoint::save(Unirit& model, torch::optim::Adam& optimiser, std::int64_t step,
                      double seconds) const {
  torch::serialize::OutputArchive archive, network, state;
  model->save(network);
  optimiser.save(state);
  archive.write("network", network);
  archive.write("optimiser", state);
  archive.write("pairing", torch::tensor(static_cast<int>(model->pairing())));
  archive.write("step", torch::tensor(step));
  archive.write("seconds", torch::tensor(seconds, torch::kFloat64));
  const std::filesystem::path fresh = path_.string() + ".new";
  archive.save_to(fresh.string());
  std::filesystem::rename(fresh, path_);
}

bool Checkpoint::load(Unirit& model, torch::optim::Adam& optimiser, std::int64_t& step,
                      double& seconds) const {
  if (!std::filesystem::exists(path_)) return false;
  try {
    torch::serialize::InputArchive archive, network, state;
    torch::Tensor saved_pairing, saved_step, saved_seconds;
    archive.load_from(path_.string());
    archive.read("pairing", saved_pairing);
    if (saved_pairing.item<int>() != static_cast<int>(model->pairing())) {
      throw std::runtime_error(path_.string() + ": its network's pairing is another");
    }
    archive.read("network", network);
    archive.read("optimiser", state);
    archive.read("step", saved_step);
    archive.read("seconds", saved_seconds);
    model->load(network);
    optimiser.load(state);
    step = saved_step.item<std::int64_t>();
    seconds = saved_seconds.item<double>();
  } catch (const c10::Error& error) {
    throw std::runtime_error(path_.string() + ": not a checkpoint of this network (" +
                             error.what_without_backtrace() + ")");
  }
  return true;
}

}  // namespace unirit::training
