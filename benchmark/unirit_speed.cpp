// SPDX-License-Identifier: BSD-3-Clause
#include <cblas.h>
#include <malloc.h>
#include <unistd.h>

#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "network/kernels.hpp"
#include "speed.hpp"

namespace unirit::speed {
namespace {

/// The whole network: 8 rigid iterations, then the displacement of each of the 1024 points.
void measureForward(benchmark::State& state, Pairing pairing) {
  Network network(weights(pairing), {kRigidIterations, pairing}, threadsOf(state));
  Points displacements;
  for (auto _ : state) {
    benchmark::DoNotOptimize(network.estimateRigid(source(), target()));
    network.estimateDisplacements(source(), target(), source(), displacements);
  }
  state.SetLabel(toString(selectKernels().instruction_set));
  setRate(state, forwardMultiplyAdds(pairing));
}

void unirit_forward(benchmark::State& state) { measureForward(state, NetworkSettings().pairing); }
void published_forward(benchmark::State& state) { measureForward(state, Pairing::kNearest); }

/// The displacement of every vertex of an organ of 20,000, features included.
void unirit_vertices(benchmark::State& state) {
  Network network(weights(NetworkSettings().pairing), {}, threadsOf(state));
  const Points vertices = randomPoints(kVertices, 3);
  Points displacements;
  for (auto _ : state) {
    network.estimateDisplacements(source(), target(), vertices, displacements);
  }
  state.SetLabel(toString(selectKernels().instruction_set));
}

/// What the machine can do: OpenBLAS on a product of two 1024 x 1024 matrices.
void openblas_gemm(benchmark::State& state) {
  constexpr int kSize = 1024;
  const std::vector<float> a(kSize * kSize, 0.5F);
  const std::vector<float> b(kSize * kSize, 0.25F);
  std::vector<float> c(kSize * kSize);
  openblas_set_num_threads(threadsOf(state));
  for (auto _ : state) {
    cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, kSize, kSize, kSize, 1.0F, a.data(),
                kSize, b.data(), kSize, 0.0F, c.data(), kSize);
    benchmark::DoNotOptimize(c.data());
  }
  state.SetLabel(openblas_get_corename());
  setRate(state, static_cast<double>(kSize) * kSize * kSize);
}

BENCHMARK(openblas_gemm)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(unirit_forward)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(published_forward)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);
BENCHMARK(unirit_vertices)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

/// OpenBLAS 0.3.21 takes processors newer than itself for very old ones, which would flatter the
/// comparison. It reads its kernels' name when it is loaded, hence the second start.
void startAgainWithRightKernels(char** arguments) {
  constexpr char kVariable[] = "OPENBLAS_CORETYPE";
  const InstructionSet best = supportedInstructionSets().back();
  const std::string kernels = best == InstructionSet::kAvx512 ? "SkylakeX" : "Haswell";
  const char* given = std::getenv(kVariable);
  if (best != InstructionSet::kBaseline && (given == nullptr || given != kernels)) {
    setenv(kVariable, kernels.c_str(), 1);
    execv("/proc/self/exe", arguments);
  }
}

/// A rival that allocates anew in every call should not wait for the system's pages each time,
/// which doubles the time of some.
void keepMemory() {
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
}

}  // namespace
}  // namespace unirit::speed

int main(int argc, char** argv) {
  unirit::speed::startAgainWithRightKernels(argv);
  unirit::speed::keepMemory();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) {
    return 1;
  }
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
