// SPDX-License-Identifier: BSD-3-Clause
#include <cblas.h>

#include "libtorch_network.hpp"
#include "speed.hpp"

namespace unirit::speed {
namespace {

torch::Tensor toTensor(const Points& points) {
  return torch::from_blob(const_cast<float*>(points.data()), {points.cols(), 3}).clone();
}

/// Largest difference between what the two networks make of the same pair.
float disagreement(const LibtorchNetwork& other) {
  Network network(weights(Pairing::kNearest), {kRigidIterations, Pairing::kNearest}, 1);
  const Points moved = network.estimateRigid(source(), target()) * source();
  const Points displacements = network.estimateDisplacements(moved, target(), moved);
  const auto clouds = toTensor(target());
  const auto other_moved = other.moveRigidly(toTensor(source()), clouds, kRigidIterations);
  const auto rigid = (other_moved - toTensor(moved)).abs().max();
  const auto nonrigid =
      (other.estimateDisplacements(toTensor(moved), clouds) - toTensor(displacements)).abs().max();
  return torch::max(rigid, nonrigid).item<float>();
}

/// The same work as published_forward; refuses to be timed where its output differs.
void libtorch_forward(benchmark::State& state) {
  const torch::NoGradGuard no_grad;
  const auto threads = static_cast<int>(state.range(0));
  torch::set_num_threads(threads);
  openblas_set_num_threads(threads);
  const LibtorchNetwork network(*weights(Pairing::kNearest));
  constexpr float kTolerance = 1e-4F;
  if (!(disagreement(network) < kTolerance)) {
    state.SkipWithError("LibTorch's output is not the network's");
    return;
  }
  const torch::Tensor source_tensor = toTensor(source());
  const torch::Tensor target_tensor = toTensor(target());
  for (auto _ : state) {
    const auto moved = network.moveRigidly(source_tensor, target_tensor, kRigidIterations);
    benchmark::DoNotOptimize(network.estimateDisplacements(moved, target_tensor).data_ptr());
  }
  setRate(state, forwardMultiplyAdds(Pairing::kNearest));
}

BENCHMARK(libtorch_forward)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace unirit::speed
