// SPDX-License-Identifier: BSD-3-Clause
#include "libtorch_network.hpp"

namespace unirit::speed {
namespace {

torch::Tensor toTensor(const Eigen::MatrixXf& matrix) {
  // A column-major matrix is its transpose, row-major
  return torch::from_blob(const_cast<float*>(matrix.data()), {matrix.cols(), matrix.rows()})
      .t()
      .clone(torch::MemoryFormat::Contiguous);
}

/// Of a quaternion w x y z, not yet normalised.
torch::Tensor rotationOf(const torch::Tensor& quaternion) {
  const torch::Tensor unit = (quaternion / quaternion.norm()).contiguous();
  const float* q = unit.data_ptr<float>();
  const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> rotation =
      Eigen::Quaternionf(q[0], q[1], q[2], q[3]).toRotationMatrix();
  return torch::from_blob(const_cast<float*>(rotation.data()), {3, 3}).clone();
}

}  // namespace

LibtorchNetwork::LibtorchNetwork(const Weights& weights) {
  for (const LayerShape& shape : layerShapes(weights.pairing)) {
    const Layer& layer = weights.layers.at(shape.name);
    stacks_[shape.name.substr(0, shape.name.rfind('.'))].push_back(
        {toTensor(layer.weight), toTensor(layer.bias).flatten()});
  }
  Stack& decoder = stacks_.at("nonrigid.decoder");
  const Linear first = decoder.front();
  const auto columns = first.weight.split_with_sizes({3, 2 * kFeatureSize, 3}, 1);
  point_layer_.weight = torch::cat({columns[0], columns[2]}, 1);
  feature_layer_ = {columns[1].contiguous(), first.bias};
  decoder.erase(decoder.begin());
}

torch::Tensor LibtorchNetwork::run(const Stack& layers, torch::Tensor values) {
  for (std::size_t i = 0; i < layers.size(); ++i) {
    values = torch::linear(values, layers[i].weight, layers[i].bias);
    if (i + 1 < layers.size()) {
      values.relu_();
    }
  }
  return values;
}

torch::Tensor LibtorchNetwork::encode(const std::string& name, const torch::Tensor& points) const {
  return run(stacks_.at(name), points).amax(0).relu_();  // the maximum commutes with the ReLU
}

torch::Tensor LibtorchNetwork::moveRigidly(torch::Tensor source, const torch::Tensor& target,
                                           int iterations) const {
  const torch::Tensor target_feature = encode("rigid.target_encoder", target);
  for (int i = 0; i < iterations; ++i) {
    const torch::Tensor features =
        torch::cat({encode("rigid.source_encoder", source), target_feature});
    const torch::Tensor pose = run(stacks_.at("rigid.decoder"), features);
    source = torch::addmm(pose.slice(0, 4, 7), source, rotationOf(pose.slice(0, 0, 4)).t());
  }
  return source;
}

torch::Tensor LibtorchNetwork::estimateDisplacements(const torch::Tensor& source,
                                                     const torch::Tensor& target) const {
  const torch::Tensor features = torch::cat(
      {encode("nonrigid.source_encoder", source), encode("nonrigid.target_encoder", target)});
  const torch::Tensor bias = torch::linear(features, feature_layer_.weight, feature_layer_.bias);
  const torch::Tensor offset =
      target.index_select(0, torch::cdist(source, target).argmin(1)) - source;
  const torch::Tensor first =
      torch::linear(torch::cat({source, offset}, 1), point_layer_.weight, bias).relu_();
  return run(stacks_.at("nonrigid.decoder"), first);
}

}  // namespace unirit::speed
