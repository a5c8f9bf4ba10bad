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
Surroundings onCpu(const torch::Tensor& source, const torch::Tensor& deformation,
                   const torch::Tensor& target) {
  auto of_source = torch::empty({source.size(0), source.size(1), kFlowInputs});
  auto of_target = torch::empty({target.size(0), target.size(1), kFlowTargetInputs});
  Workspace workspace(selectKernels(), 1);
  unirit::Surroundings reader(workspace);
  std::vector<float> rows;
  for (std::int64_t pair = 0; pair < source.size(0); ++pair) {
    reader.setTarget(toPoints(target[pair]));
    reader.setSource(toPoints(source[pair]), toPoints(deformation[pair]));
    reader.ofSource(rows);
    std::copy(rows.begin(), rows.end(), of_source[pair].data_ptr<float>());
    const RowsView read = reader.ofTarget();
    std::copy_n(read.data, read.count * read.stride, of_target[pair].data_ptr<float>());
  }
  return {of_source, of_target};
}

/// The directions in which the points about each vary least, [B, N, 3].
torch::Tensor normalsOf(const torch::Tensor& points) {
  const double scale = kFlowScales.back();
  const auto kernel = torch::cdist(points, points).square_().mul_(-0.5 / (scale * scale)).exp_();
  const auto weights = kernel / kernel.sum(2, true);
  const auto squares = (points.unsqueeze(3) * points.unsqueeze(2)).flatten(2);
  const auto mean = torch::bmm(weights, points);
  const auto covariance =
      torch::bmm(weights, squares).unflatten(2, {3, 3}) - mean.unsqueeze(3) * mean.unsqueeze(2);
  return std::get<1>(torch::linalg_eigh(covariance, "L")).select(3, 0);
}

/// As unirit::CoherentWay: the vectors, [B, N, 3], that take `source` to the planes through some of
/// the target's points, which have these normals and nearest points of the source.
torch::Tensor coherentWay(const torch::Tensor& source, const torch::Tensor& target,
                          const torch::Tensor& normals, const torch::Tensor& nearest) {
  const auto chosen = evenlyChosen(target.size(1), kFlowPlanes, target.device());
  const auto normal = normals.index_select(1, chosen);
  const auto point = source.gather(1, ofPoints(nearest.index_select(1, chosen)));
  const auto offset = target.index_select(1, chosen) - point;
  const auto closeness = [&](const torch::Tensor& points) {
    return torch::cdist(points, point).square_().mul_(-0.5 / (kFlowLength * kFlowLength)).exp_();
  };
  const double amplitude = kFlowAmplitude * kFlowAmplitude,
               rigid = kFlowRigidAmplitude * kFlowRigidAmplitude,
               noise = kFlowPlaneNoise * kFlowPlaneNoise, reach = kFlowPlaneReach * kFlowPlaneReach;
  const auto wrench = torch::cat({normal, torch::cross(point, normal, 2)}, 2);
  auto covariance = amplitude * closeness(point) * torch::bmm(normal, normal.transpose(1, 2)) +
                    rigid * torch::bmm(wrench, wrench.transpose(1, 2));
  const auto diagonal = covariance.diagonal(0, 1, 2);
  diagonal.mul_(1.0 + kFlowPlaneRounding).add_(noise * (1.0 + offset.square().sum(2) / reach));
  const auto gains =
      torch::cholesky_solve((normal * offset).sum(2, true), torch::linalg_cholesky(covariance));
  const auto motion = rigid * torch::bmm(wrench.transpose(1, 2), gains).transpose(1, 2);
  const auto turn = motion.slice(2, 3, 6).expand_as(source);
  return motion.slice(2, 0, 3) + torch::cross(turn, source, 2) +
         torch::bmm(closeness(source), amplitude * gains * normal);
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

torch::Tensor evenlyChosen(std::int64_t all, std::int64_t at_most, torch::Device device) {
  const std::int64_t count = std::min(all, at_most);
  const auto numbers = torch::arange(count, torch::TensorOptions(torch::kLong).device(device));
  return torch::div(numbers * all, count, "floor");
}

Surroundings surroundings(const torch::Tensor& source, const torch::Tensor& deformation,
                          const torch::Tensor& target) {
  const torch::NoGradGuard no_grad;
  return source.is_cpu() ? onCpu(source, deformation, target)
                         : onAnyDevice(source, deformation, target);
}

Surroundings onAnyDevice(const torch::Tensor& source, const torch::Tensor& deformation,
                         const torch::Tensor& target) {
  const torch::NoGradGuard no_grad;
  const at::NoTF32Guard no_tf32;
  const auto distances = torch::cdist(source, target);
  const auto to_target = target.gather(1, ofPoints(distances.argmin(2))) - source;
  const auto nearest = distances.argmin(1);  // of the source
  const auto to_source = source.gather(1, ofPoints(nearest)) - target;

  const auto target_normals = normalsOf(target);
  const auto normals = target_normals.gather(1, ofPoints(distances.argmin(2)));
  const auto to_plane = normals * (normals * to_target).sum(2, true);
  const auto planes = (normals.unsqueeze(3) * normals.unsqueeze(2)).flatten(2);

  // Of each point of the source: its own vector and those of the target's points it is nearest to
  const auto ones = torch::ones_like(target.slice(2, 0, 1));
  const auto count =
      torch::zeros_like(source.slice(2, 0, 1)).scatter_add_(1, nearest.unsqueeze(2), ones);
  const auto sum = torch::zeros_like(source).scatter_add_(1, ofPoints(nearest), -to_source);
  const auto values = torch::cat(
      {to_target, sum, count, torch::ones_like(count), deformation, to_plane, planes}, 2);

  const double ratio = static_cast<double>(source.size(1)) / static_cast<double>(target.size(1));
  std::vector<torch::Tensor> inputs{source};
  std::vector<torch::Tensor> vectors{to_target, deformation,
                                     coherentWay(source, target, target_normals, nearest)};
  const auto squares = torch::cdist(source, source).square_();
  auto kernel = squares.mul_(-0.5 / (kFlowScales[0] * kFlowScales[0])).exp_();
  for (std::size_t scale = 0; scale < kFlowScales.size(); ++scale) {
    if (scale > 0) kernel.square_().square_();  // each scale is half the one before
    const auto sums = torch::bmm(kernel, values).split_with_sizes({3, 3, 1, 1, 3, 3, 9}, 2);
    vectors.push_back(sums[0] / sums[3]);
    vectors.push_back(sums[1] / (sums[2] + kFlowFewest));
    vectors.push_back(sums[4] / sums[3]);
    const auto normal_matrix = (sums[6] / sums[3]).unflatten(2, {3, 3}) +
                               kFlowPlaneRidge * torch::eye(3, source.options());
    vectors.push_back(
        torch::linalg_solve(normal_matrix, (sums[5] / sums[3]).unsqueeze(3)).squeeze(3));
    inputs.push_back(sums[2] / sums[3] * ratio);
  }
  const auto all = torch::stack(vectors, 2);
  inputs.push_back(all.flatten(2));
  inputs.push_back((all.square().sum(3) + 1e-12).sqrt());
  return {torch::cat(inputs, 2), torch::cat({target, to_source}, 2)};
}

}  // namespace unirit::training
