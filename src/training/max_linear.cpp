// SPDX-License-Identifier: BSD-3-Clause
#include "max_linear.hpp"

#include <limits>

namespace unirit::training {
namespace {

using torch::autograd::AutogradContext;
using torch::autograd::tensor_list;

/// Adds gradient * from to a row.
void accumulate(float gradient, const float* from, float* row, std::int64_t size) {
  for (std::int64_t k = 0; k < size; ++k) row[k] += gradient * from[k];
}

/// Largest product of every channel over the points, and the point that holds it.
[[gnu::target_clones("avx512f", "avx2", "default")]] void keepMaxima(const float* products,
                                                                     std::int64_t points,
                                                                     std::int64_t channels,
                                                                     float* maximum,
                                                                     std::int32_t* index) {
  for (std::int64_t n = 0; n < points; ++n) {
    const float* product = products + n * channels;
    for (std::int64_t c = 0; c < channels; ++c) {
      const bool larger = product[c] > maximum[c];
      index[c] = larger ? static_cast<std::int32_t>(n) : index[c];
      maximum[c] = larger ? product[c] : maximum[c];
    }
  }
}

/// Maxima and the points that hold them, [B, C] each.
std::pair<torch::Tensor, torch::Tensor> maximaInLoops(const torch::Tensor& pairs,
                                                      const torch::Tensor& weight) {
  const auto transposed = weight.t();
  const std::int64_t batch = pairs.size(0), points = pairs.size(1), channels = weight.size(0);
  auto maximum = torch::full({batch, channels}, -std::numeric_limits<float>::infinity());
  auto index = torch::zeros({batch, channels}, torch::kInt32);
  for (std::int64_t b = 0; b < batch; ++b) {  // one pair's products stay in the cache
    const auto products = torch::mm(pairs[b], transposed);
    keepMaxima(products.data_ptr<float>(), points, channels,
               maximum.data_ptr<float>() + b * channels,
               index.data_ptr<std::int32_t>() + b * channels);
  }
  return {maximum, index};
}

std::pair<torch::Tensor, torch::Tensor> maximaByTensors(const torch::Tensor& pairs,
                                                        const torch::Tensor& weight) {
  const auto [maximum, index] = torch::matmul(pairs, weight.t()).max(1);
  return {maximum, index};
}

/// Gradients of the values and of the weight.
std::pair<torch::Tensor, torch::Tensor> gradientsInLoops(const torch::Tensor& values,
                                                         const torch::Tensor& weight,
                                                         const torch::Tensor& index,
                                                         const torch::Tensor& gradient) {
  const std::int64_t batch = values.size(0), points = values.size(1), inputs = values.size(2);
  const std::int64_t channels = weight.size(0);
  auto value_gradient = torch::zeros_like(values);
  auto weight_gradient = torch::zeros_like(weight);
  const float *v = values.data_ptr<float>(), *w = weight.data_ptr<float>(),
              *g = gradient.data_ptr<float>();
  const std::int32_t* n = index.data_ptr<std::int32_t>();
  float *dv = value_gradient.data_ptr<float>(), *dw = weight_gradient.data_ptr<float>();
  for (std::int64_t i = 0; i < batch * channels; ++i) {
    if (g[i] == 0.0F) continue;
    const std::int64_t point = i / channels * points + n[i], channel = i % channels;
    accumulate(g[i], w + channel * inputs, dv + point * inputs, inputs);
    accumulate(g[i], v + point * inputs, dw + channel * inputs, inputs);
  }
  return {value_gradient, weight_gradient};
}

/// The same by whole tensors, as a graphics processor wants it.
std::pair<torch::Tensor, torch::Tensor> gradientsByTensors(const torch::Tensor& values,
                                                           const torch::Tensor& weight,
                                                           const torch::Tensor& index,
                                                           const torch::Tensor& gradient) {
  const auto holders = index.unsqueeze(2).expand({-1, -1, values.size(2)});  // [B, C, K]
  const auto column = gradient.unsqueeze(2);
  auto value_gradient = torch::zeros_like(values).scatter_add_(1, holders, column * weight);
  return {value_gradient, (column * values.gather(1, holders)).sum(0)};
}

/// The loops read floats in memory.
bool fitsLoops(const torch::Tensor& tensor) {
  return tensor.is_cpu() && tensor.scalar_type() == torch::kFloat32;
}

class SparseMaxLinear : public torch::autograd::Function<SparseMaxLinear> {
 public:
  static torch::Tensor forward(AutogradContext* context, const torch::Tensor& values,
                               const torch::Tensor& weight, const torch::Tensor& bias) {
    const auto pairs = values.contiguous();
    const auto [maximum, index] =
        fitsLoops(pairs) ? maximaInLoops(pairs, weight) : maximaByTensors(pairs, weight);
    context->save_for_backward({pairs, weight.contiguous(), index});
    return maximum + bias;
  }

  static tensor_list backward(AutogradContext* context, const tensor_list& outputs) {
    const auto saved = context->get_saved_variables();
    const auto &values = saved[0], &weight = saved[1], &index = saved[2];
    const auto gradient = outputs[0].contiguous();
    const auto [value_gradient, weight_gradient] =
        fitsLoops(values) ? gradientsInLoops(values, weight, index, gradient)
                          : gradientsByTensors(values, weight, index, gradient);
    return {value_gradient, weight_gradient, gradient.sum(0)};
  }
};

}  // namespace

torch::Tensor maxLinear(const torch::Tensor& values, const torch::Tensor& weight,
                        const torch::Tensor& bias) {
  return SparseMaxLinear::apply(values, weight, bias);
}

}  // namespace unirit::training
