// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "unirit/evaluation/pair.hpp"

namespace unirit {

/// One deformation of one organ, seen under every protocol of its set.
struct PairSetCase {
  std::string organ;       ///< class, "liver"
  std::string subject;     ///< name of the file it was made from, without extension
  int variation = 0;       ///< 0: the organ as it was read; 1, 2, ...: varied anatomies of it
  int deformation = 0;     ///< counts the deformations of the same surface from 0
  std::uint64_t seed = 0;  ///< of makeSeenOrgan
  SeenOrgan seen;
};

/// Pairs as they stand in one file: safetensors (https://github.com/huggingface/safetensors), of
/// which docs/pairs.md lists the tensors and shows how python reads them.
struct PairSet {
  std::vector<Protocol> protocols;
  std::vector<PairSetCase> cases;

  /// Throws std::invalid_argument where the set lacks the protocol.
  RegistrationPair pair(const PairSetCase& one, Protocol protocol) const;
};

/// Writes the file atomically; of interior points as many as every case has. Throws
/// std::invalid_argument where the set is empty or cases differ in their numbers of points or
/// sights, std::runtime_error where the file cannot be written.
void writePairSet(const PairSet& set, const std::string& path);

/// The set as it was written, bit for bit. Throws std::runtime_error with a sentence that names the
/// file and what is wrong with it: missing, damaged, no pair set, or of another version.
PairSet readPairSet(const std::string& path);

}  // namespace unirit
