// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <torch/torch.h>

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "unirit/evaluation/pair.hpp"
#include "unirit/io/organ_folder.hpp"

namespace unirit::training {

/// Pairs in the network's unit, [B, N, 3] each.
struct Batch {
  torch::Tensor source;
  torch::Tensor start;  ///< where it stood when the flow began to move it; the same in a new batch
  torch::Tensor target;
  torch::Tensor truth;  ///< where each source point truly went
  torch::Tensor rigid;  ///< where the best rigid fit takes it
  torch::Tensor scale;  ///< [B], metres per unit
};

/// What training pairs look like.
struct BatchSettings {
  std::int64_t pairs = 32;
  std::int64_t points = 256;
  std::int64_t pairs_per_deformation = 4;
  View::Target target = View::Target::kResampled;
  double partial_share = 0.4;     ///< of pairs, the target being 30 to 80 % of the surface
  double near_share = 0.0;        ///< of pairs, neither rotated nor translated
  double centred_share = 0.3;     ///< of pairs, the clouds' centroids brought together before
  double rotation = 50.0;         ///< between the clouds, at most [degree]
  double translation = 0.25;      ///< between the clouds, per axis, at most, over the half extent
  double common_rotation = 30.0;  ///< of both clouds, at most [degree]
  double stretch = 0.15;          ///< random scaling of each axis of the organ, at most
};

/// Batch number `index`: depends on the seed and the number alone. Classes are drawn in proportion
/// to the square root of their organs, so that rare ones are not drowned.
Batch makeBatch(const std::vector<Organ>& organs, const BatchSettings& settings, std::uint64_t seed,
                std::int64_t index);

/// Pairs of the given organs under a protocol, `per_organ` each, for validation.
Batch makeValidation(const std::vector<Organ>& organs, Protocol protocol, std::int64_t per_organ,
                     std::int64_t points, std::uint64_t seed);

/// Makes batches ahead of the trainer, in order, on its own threads; `organs` must outlive it. What
/// goes wrong there is thrown by next().
class BatchQueue {
 public:
  BatchQueue(const std::vector<Organ>& organs, const BatchSettings& settings, std::uint64_t seed,
             std::int64_t first, int threads);
  ~BatchQueue();

  Batch next();

 private:
  void work();

  const std::vector<Organ>& organs_;
  const BatchSettings settings_;
  const std::uint64_t seed_;
  const std::int64_t ahead_;  // batches made before they are asked for
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::int64_t, Batch> ready_;
  std::exception_ptr fault_;  // of a thread, for next() to throw
  std::int64_t next_made_, next_taken_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace unirit::training
