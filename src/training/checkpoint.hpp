// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <torch/torch.h>

#include <filesystem>

#include "model.hpp"

namespace unirit::training {

/// Network, optimiser and progress in one file, checkpoint.pt of a folder, replaced atomically.
class Checkpoint {
 public:
  explicit Checkpoint(const std::filesystem::path& folder) : path_(folder / "checkpoint.pt") {}

  void save(Unirit& model, torch::optim::Adam& optimiser, std::int64_t step, double seconds) const;

  /// False where there is none. Throws std::runtime_error where the file is damaged or of another
  /// network.
  bool load(Unirit& model, torch::optim::Adam& optimiser, std::int64_t& step,
            double& seconds) const;

 private:
  std::filesystem::path path_;
};

}  // namespace unirit::training
