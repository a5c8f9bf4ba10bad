// SPDX-License-Identifier: BSD-3-Clause
// Speed at which one thread makes pairs for the training, from phantoms as unirit_train draws them.
#include "speed.hpp"
#include "training/batch.hpp"
#include "unirit/simulation/phantom.hpp"

namespace unirit::speed {
namespace {

const std::vector<Organ>& organs() {
  static const std::vector<Organ> phantoms = [] {
    std::vector<Organ> made;
    for (const std::string& name : phantomOrgans()) {
      made.push_back({name, "1", makePhantom(name, 1, 5000)});
    }
    return made;
  }();
  return phantoms;
}

/// Items are pairs, so items_per_second is what one core makes.
void training_pairs(benchmark::State& state) {
  training::BatchSettings settings;
  settings.points = state.range(0);
  torch::set_num_threads(1);
  std::int64_t batches = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(training::makeBatch(organs(), settings, 1, batches++));
  }
  state.SetItemsProcessed(batches * settings.pairs);
}

BENCHMARK(training_pairs)->Arg(128)->Arg(256)->Arg(1024)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace unirit::speed
