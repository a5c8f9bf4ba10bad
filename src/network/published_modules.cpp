// SPDX-License-Identifier: BSD-3-Clause
#include "encoder.hpp"
#include "modules.hpp"
#include "nearest_offsets.hpp"
#include "point_decoder.hpp"

namespace unirit {
namespace {

RowsView rowsOf(const Points& points) { return {points.data(), 3, points.cols()}; }

class PublishedModules : public Modules {
 public:
  PublishedModules(const Weights& weights, Workspace& workspace)
      : workspace_(workspace), pairing_(weights.pairing), weights_(weights) {}

  RigidStep rigidStep(const Points& moved, const Points& target, bool first,
                      bool /*fine*/) override {
    float* features = rigid_features_.data();
    rigid_source_.encode(rowsOf(moved), features, workspace_);
    // The target's feature stands still
    if (first) rigid_target_.encode(rowsOf(target), features + kFeatureSize, workspace_);
    return rigid_decoder_.decode(features, workspace_);
  }

  void displace(const Points& source, const Points& target, const Points& queries,
                Points& displacements) override {
    float* features = nonrigid_features_.data();
    nonrigid_source_.encode(rowsOf(source), features, workspace_);
    nonrigid_target_.encode(rowsOf(target), features + kFeatureSize, workspace_);
    if (pairing_ == Pairing::kNearest) to_target_.setOthers(target);
    nonrigid_decoder_.decode(
        features, queries.cols(), workspace_,
        [&](Scratch& scratch, long begin, long count) {
          return inputs(queries, target, scratch, begin, count);
        },
        [&](long begin, const RowsView& outputs) {
          for (long i = 0; i < outputs.count; ++i) {
            displacements.col(begin + i) =
                Eigen::Map<const Eigen::Vector3f>(outputs.data + i * outputs.stride);
          }
        });
  }

  const Eigen::VectorXf& rigidFeatures() const override { return rigid_features_; }
  const Eigen::VectorXf& nonRigidFeatures() const override { return nonrigid_features_; }

 private:
  /// Points and, with a pairing, what they are paired with.
  RowsView inputs(const Points& queries, const Points& target, Scratch& scratch, long begin,
                  long count) const {
    if (pairing_ == Pairing::kNone) return {queries.data() + 3 * begin, 3, count};
    if (pairing_ == Pairing::kNearest) {
      return to_target_.rows(queries, begin, count, scratch, workspace_.kernels());
    }
    Eigen::Map<Eigen::Matrix<float, 6, Eigen::Dynamic>> rows(scratch.inputs.data(), 6, count);
    rows.topRows<3>() = queries.middleCols(begin, count);
    rows.bottomRows<3>() = target.middleCols(begin, count);
    return {scratch.inputs.data(), 6, count};
  }

  Workspace& workspace_;
  Pairing pairing_;
  const Weights& weights_;
  const Kernels& kernels_ = workspace_.kernels();
  Encoder rigid_source_{kernels_, weights_, "rigid.source_encoder"};
  Encoder rigid_target_{kernels_, weights_, "rigid.target_encoder"};
  RigidDecoder rigid_decoder_{kernels_, weights_};
  Encoder nonrigid_source_{kernels_, weights_, "nonrigid.source_encoder"};
  Encoder nonrigid_target_{kernels_, weights_, "nonrigid.target_encoder"};
  PointDecoder nonrigid_decoder_{kernels_,
                                 weights_,
                                 "nonrigid.decoder",
                                 static_cast<int>(kNonRigidDecoderWidths.size()),
                                 3,
                                 2 * kFeatureSize};
  Eigen::VectorXf rigid_features_ = Eigen::VectorXf::Zero(2 * kFeatureSize);
  Eigen::VectorXf nonrigid_features_ = Eigen::VectorXf::Zero(2 * kFeatureSize);
  NearestOffsets to_target_;
};

}  // namespace

std::unique_ptr<Modules> makePublishedModules(const Weights& weights, Workspace& workspace) {
  return std::make_unique<PublishedModules>(weights, workspace);
}

}  // namespace unirit
