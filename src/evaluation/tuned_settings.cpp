// SPDX-License-Identifier: BSD-3-Clause
#include <array>

#include "unirit/evaluation/method_factory.hpp"

namespace unirit {
namespace {

// What scripts/tune_rivals.py found on training organs, in the sequence of this list.
constexpr std::array<Protocol, 5> kTuned{Protocol::kPermuted, Protocol::kResampled,
                                         Protocol::kCaseB, Protocol::kPartial, Protocol::kIntraop};

struct IcpRow {
  double max_distance;
  bool centroids;
};
constexpr std::array<IcpRow, 5> kIcp{
    {{0.1, false}, {0.1, false}, {0.1, false}, {0.05, false}, {0.1, false}}};
constexpr std::array<IcpRow, 5> kGeneralizedIcp{
    {{0.1, true}, {0.1, false}, {0.2, true}, {0.4, false}, {0.4, false}}};

struct CpdRow {
  double beta, lambda, outliers;
  bool centroids;
};
constexpr std::array<CpdRow, 5> kRigidCpd{{{2.0, 2.0, 0.7, true},
                                           {2.0, 2.0, 0.7, false},
                                           {2.0, 2.0, 0.7, true},
                                           {2.0, 2.0, 0.7, false},
                                           {2.0, 2.0, 0.7, false}}};
constexpr std::array<CpdRow, 5> kCpd{{{0.7, 20.0, 0.01, true},
                                      {0.7, 500.0, 0.7, false},
                                      {2.5, 20.0, 0.7, true},
                                      {0.7, 2000.0, 0.01, false},
                                      {2.5, 500.0, 0.01, false}}};

struct BcpdRow {
  double beta, lambda, omega, gamma;
  bool scale, centroids;
};
constexpr std::array<BcpdRow, 5> kBcpd{{{1.5, 5.0, 0.3, 1.0, true, false},
                                        {2.5, 20.0, 0.3, 0.3, false, false},
                                        {1.0, 500.0, 0.1, 1.0, true, true},
                                        {1.0, 500.0, 0.3, 0.1, true, false},
                                        {0.7, 2000.0, 0.1, 0.1, true, false}}};

/// The protocol's row. `paired` is `permuted` in another sequence, which no rival sees; `offset` is
/// `caseb` with centroids that must be brought together; `camera` is disturbed as `intraop` is.
template <class Row>
Row rowOf(const std::array<Row, 5>& table, Protocol protocol) {
  Protocol tuned = protocol;
  if (protocol == Protocol::kPaired) tuned = Protocol::kPermuted;
  if (protocol == Protocol::kOffset) tuned = Protocol::kCaseB;
  if (protocol == Protocol::kCamera) tuned = Protocol::kIntraop;
  std::size_t place = 0;
  while (kTuned[place] != tuned) ++place;
  Row row = table[place];
  row.centroids = row.centroids || protocol == Protocol::kOffset;
  return row;
}

IcpSettings icp(const IcpRow& row) {
  IcpSettings settings;
  settings.max_distance = row.max_distance;
  settings.centroids = row.centroids;
  return settings;
}

CpdMethodSettings cpd(const CpdRow& row) {
  CpdMethodSettings settings;
  settings.drift.beta = row.beta;
  settings.drift.lambda = row.lambda;
  settings.drift.outliers = row.outliers;
  settings.centroids = row.centroids;
  return settings;
}

}  // namespace

IcpSettings tunedIcp(Protocol protocol) { return icp(rowOf(kIcp, protocol)); }

IcpSettings tunedGeneralizedIcp(Protocol protocol) { return icp(rowOf(kGeneralizedIcp, protocol)); }

CpdMethodSettings tunedRigidCpd(Protocol protocol) { return cpd(rowOf(kRigidCpd, protocol)); }

CpdMethodSettings tunedCpd(Protocol protocol) { return cpd(rowOf(kCpd, protocol)); }

BcpdMethodSettings tunedBcpd(Protocol protocol) {
  const BcpdRow row = rowOf(kBcpd, protocol);
  BcpdMethodSettings settings;
  settings.drift.beta = row.beta;
  settings.drift.lambda = row.lambda;
  settings.drift.omega = row.omega;
  settings.drift.gamma = row.gamma;
  settings.drift.scale = row.scale;
  settings.centroids = row.centroids;
  return settings;
}

}  // namespace unirit
