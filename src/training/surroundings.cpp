// SPDX-License-Identifier: BSD-3-Clause
#include "surroundings.hpp"

#include "../network/surroundings.hpp"

namespace unirit::training {
namespace {

/// [B, N] -> [B, N, 3], to gather points by.
torch::Tensor ofPoints(const torch::Tensor& index) {
  return index.unsqueeze(2).expand({-1, -1, 3});
}

Points toPoints(const torch::Tensor& points) {
  const torch::Tensor rows = points.contiguous();
  return Eigen::Map<const Points>(rows.data_ptr<float>(), 3, rows.size(0));
}

/// By the network's own loops, several times as fast.
Surroundings onCpu(const torch::Tensor& source, const torch::Tensor& target) {
  auto of_source = torch::empty({source.size(0), source.size(1), kFlowInputs});
  auto of_target = torch::empty({target.size(0), target.size(1), kFlowTargetInputs});
  Workspace workspace(selectKernels(), 1);
  unirit::Surroundings reader(workspace);
  std::vector<float> rows;
  for (std::int64_t pair = 0; pair < source.size(0); ++pair) {
    reader.setClouds(toPoints(source[pair]), toPoints(target[pair]));
    reader.ofSource(rows);
    std::copy(rows.begin(), rows.end(), of_source[pair].data_ptr<float>());
    const RowsView read = reader.ofTarget();
    std::copy_n(read.data, read.count * read.stride, of_target[pair].data_ptr<float>());
  }
  const auto vectors =
      of_source.slice(2, kFlowInputs - 4 * kFlowVectors, kFlowInputs - kFlowVectors);
  return {of_source, vectors.unflatten(2, {kFlowVectors, 3}), of_target};
}

}  // namespace

torch::Tensor offsets(const torch::Tensor& from, const torch::Tensor& to) {
  torch::Tensor nearest;
  {
    const torch::NoGradGuard no_grad;
    const at::NoTF32Guard no_tf32;  // its ten bits do not tell near points apart
    nearest = torch::cdist(from, to).argmin(2);
  }
  return to.gather(1, ofPoints(nearest)) - from;
}

Surroundings surroundings(const torch::Tensor& source, const torch::Tensor& target) {
  const torch::NoGradGuard no_grad;
  return source.is_cpu() ? onCpu(source, target) : onAnyDevice(source, target);
}

Surroundings onAnyDevice(const torch::Tensor& source, const torch::Tensor& target) {
  const torch::NoGradGuard no_grad;
  const at::NoTF32Guard no_tf32;
  const auto distances = torch::cdist(source, target);
  const auto to_target = target.gather(1, ofPoints(distances.argmin(2))) - source;
  const auto nearest = distances.argmin(1);  // of the source
  const auto to_source = source.gather(1, ofPoints(nearest)) - target;

  // Of each point of the source: its own vector and those of the target's points it is nearest to
  const auto ones = torch::ones_like(target.slice(2, 0, 1));
  const auto count =
      torch::zeros_like(source.slice(2, 0, 1)).scatter_add_(1, nearest.unsqueeze(2), ones);
  const auto sum = torch::zeros_like(source).scatter_add_(1, ofPoints(nearest), -to_source);
  const auto values = torch::cat({to_target, sum, count, torch::ones_like(count)}, 2);

  const double ratio = static_cast<double>(source.size(1)) / static_cast<double>(target.size(1));
  std::vector<torch::Tensor> vectors{to_target}, inputs{source};
  const auto squares = torch::cdist(source, source).square_();
  auto kernel = squares.mul_(-0.5 / (kFlowScales[0] * kFlowScales[0])).exp_();
  for (std::size_t scale = 0; scale < kFlowScales.size(); ++scale) {
    if (scale > 0) kernel.square_().square_();  // each scale is half the one before
    const auto sums = torch::bmm(kernel, values).split_with_sizes({3, 3, 1, 1}, 2);
    vectors.push_back(sums[0] / sums[3]);
    vectors.push_back(sums[1] / (sums[2] + kFlowFewest));
    inputs.push_back(sums[2] / sums[3] * ratio);
  }
  const auto all = torch::stack(vectors, 2);
  inputs.push_back(all.flatten(2));
  inputs.push_back((all.square().sum(3) + 1e-12).sqrt());
  return {torch::cat(inputs, 2), all, torch::cat({target, to_source}, 2)};
}

}  // namespace unirit::training
