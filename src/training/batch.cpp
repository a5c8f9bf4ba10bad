// SPDX-License-Identifier: BSD-3-Clause
#include "batch.hpp"

#include <cmath>
#include <utility>

#include "unirit/evaluation/pair.hpp"
#include "unirit/network/network.hpp"
#include "unirit/random.hpp"

namespace unirit::training {
namespace {

constexpr Eigen::Index kPool = 4096;  // surface points a deformation's pairs are drawn from
constexpr std::int64_t kAhead = 2;    // batches a thread makes before they are asked for

std::uint64_t mix(std::uint64_t seed, std::uint64_t number) {
  return Random(seed ^ (number * 0xD1B54A32D192ED03ULL)).next();
}

const Organ& drawOrgan(const std::vector<Organ>& organs, Random& random) {
  std::map<std::string, std::vector<const Organ*>> classes;
  for (const Organ& organ : organs) classes[organ.name].push_back(&organ);
  double total = 0.0;
  for (const auto& [name, members] : classes) total += std::sqrt(members.size());
  double place = random.uniform(0.0, total);
  for (const auto& [name, members] : classes) {
    place -= std::sqrt(members.size());
    if (place < 0.0) return *members[static_cast<std::size_t>(random.below(members.size()))];
  }
  return organs.back();
}

/// Another orientation, other proportions, left for right.
Surface vary(Surface surface, const BatchSettings& settings, Random& random) {
  const double reach = settings.stretch;
  Eigen::Vector3d stretch =
      random.uniformVector(Eigen::Vector3d::Constant(-reach), Eigen::Vector3d::Constant(reach))
          .array()
          .exp();
  const bool mirrored = random.uniform() < 0.5;
  if (mirrored) {
    stretch.x() = -stretch.x();
    surface.faces.row(1).swap(surface.faces.row(2));
  }
  const Eigen::Matrix3d map = random.rotation(settings.common_rotation) * stretch.asDiagonal();
  surface.vertices.points = map.cast<float>() * surface.vertices.points;
  return surface;
}

View drawView(const BatchSettings& settings, double half_extent, Random& random) {
  View view;
  view.target = settings.target;
  if (random.uniform() >= settings.near_share) {
    view.rotation = settings.rotation;
    view.translation = settings.translation;
  }
  if (random.uniform() < settings.partial_share) {
    view.visible_share = random.uniform(0.3, 0.8);
    view.noise = random.uniform(0.0, 0.02) * half_extent;
    view.outlier_share = random.uniform(0.0, 0.06);
  }
  return view;
}

void alignTargetCentroid(RegistrationPair& pair) {
  const Eigen::Vector3f shift = centroid(pair.source) - centroid(pair.target);
  pair.target.colwise() += shift;
  pair.truth.colwise() += shift;
  pair.best_rigid.pretranslate(shift.cast<double>());
}

torch::Tensor toTensor(const Points& points) {
  return torch::from_blob(const_cast<float*>(points.data()), {points.cols(), 3}).clone();
}

Batch stack(const std::vector<RegistrationPair>& pairs) {
  std::vector<torch::Tensor> source, target, truth, rigid;
  std::vector<float> scale;
  for (const RegistrationPair& pair : pairs) {
    const Normalisation unit = Normalisation::of(pair.source);
    source.push_back(toTensor(unit.apply(pair.source)));
    target.push_back(toTensor(unit.apply(pair.target)));
    truth.push_back(toTensor(unit.apply(pair.truth)));
    rigid.push_back(toTensor(unit.apply(moved(pair.best_rigid, pair.source))));
    scale.push_back(unit.scale);
  }
  const auto sources = torch::stack(source);
  return {sources,
          sources,
          torch::stack(target),
          torch::stack(truth),
          torch::stack(rigid),
          torch::tensor(scale)};
}

}  // namespace

Batch makeBatch(const std::vector<Organ>& organs, const BatchSettings& settings, std::uint64_t seed,
                std::int64_t index) {
  Random random(mix(seed, static_cast<std::uint64_t>(index)));
  std::vector<RegistrationPair> pairs;
  while (static_cast<std::int64_t>(pairs.size()) < settings.pairs) {
    const Surface organ = vary(drawOrgan(organs, random).surface, settings, random);
    const double half_extent = extent(organ.vertices.points) / 2.0;
    const DeformedOrgan deformed(organ, random.next(), kPool);
    for (std::int64_t k = 0; k < settings.pairs_per_deformation; ++k) {
      const View view = drawView(settings, half_extent, random);
      pairs.push_back(deformed.pair(view, settings.points, random.next()));
      if (random.uniform() < settings.centred_share) alignTargetCentroid(pairs.back());
    }
  }
  pairs.resize(static_cast<std::size_t>(settings.pairs));
  return stack(pairs);
}

Batch makeValidation(const std::vector<Organ>& organs, Protocol protocol, std::int64_t per_organ,
                     std::int64_t points, std::uint64_t seed) {
  std::vector<RegistrationPair> pairs;
  for (const Organ& organ : organs) {
    for (std::int64_t k = 0; k < per_organ; ++k) {
      pairs.push_back(makePair(organ.surface, protocol, points, mix(seed, pairs.size())));
    }
  }
  return stack(pairs);
}

BatchQueue::BatchQueue(const std::vector<Organ>& organs, const BatchSettings& settings,
                       std::uint64_t seed, std::int64_t first, int threads)
    : organs_(organs),
      settings_(settings),
      seed_(seed),
      ahead_(kAhead * threads),
      next_made_(first),
      next_taken_(first) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

BatchQueue::~BatchQueue() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

Batch BatchQueue::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return fault_ || ready_.count(next_taken_) > 0; });
  if (fault_) std::rethrow_exception(fault_);
  Batch batch = std::move(ready_.extract(next_taken_).mapped());
  ++next_taken_;
  changed_.notify_all();
  return batch;
}

void BatchQueue::work() try {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stopping_ || next_made_ - next_taken_ < ahead_; });
    if (stopping_) return;
    const std::int64_t index = next_made_++;
    lock.unlock();
    Batch batch = makeBatch(organs_, settings_, seed_, index);
    lock.lock();
    ready_.emplace(index, std::move(batch));
    changed_.notify_all();
  }
} catch (...) {
  const std::lock_guard lock(mutex_);
  fault_ = std::current_exception();
  changed_.notify_all();
}

}  // namespace unirit::training
