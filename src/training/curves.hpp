// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "trainer.hpp"

namespace unirit::training {

/// The file that shows how a training went, a row a report.
class Curves {
 public:
  /// Goes on with the file where `resumed`, else begins it. Throws std::runtime_error where it
  /// cannot be written.
  Curves(const std::filesystem::path& path, bool resumed, const std::vector<Protocol>& protocols)
      : file_(path, resumed ? std::ios::app : std::ios::trunc) {
    if (!file_) throw std::runtime_error(path.string() + ": cannot be written");
    if (!resumed) {
      file_ << "step,seconds,pairs_per_second,learning_rate,loss";
      for (const Protocol protocol : protocols) {
        file_ << ',' << toString(protocol) << "_rigid_mm," << toString(protocol) << "_final_mm";
      }
      file_ << std::endl;
    }
  }

  /// Errors in millimetres.
  void append(const Progress& p) {
    file_ << p.step << ',' << p.seconds << ',' << p.pairs_per_second << ',' << p.learning_rate
          << ',' << p.loss;
    for (const ValidationErrors& errors : p.validation) {
      file_ << ',' << 1000.0 * errors.rigid << ',' << 1000.0 * errors.final;
    }
    file_ << std::endl;
  }

 private:
  std::ofstream file_;
};

}  // namespace unirit::training
