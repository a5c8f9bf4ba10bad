// SPDX-License-Identifier: BSD-3-Clause
#include "unirit/evaluation/divergence_table.hpp"

#include <cmath>
#include <cstdio>
#include <limits>
#include <map>

#include "unirit/evaluation/gaussian_mixture.hpp"
#include "unirit/network/network.hpp"
#include "unirit/random.hpp"

namespace unirit {
namespace {

struct FittedCloud {
  Points points;
  GaussianMixture mixture;
};
using Class = std::vector<FittedCloud>;

std::map<std::string, Class> fitAll(const std::vector<LabelledCloud>& clouds,
                                    const DivergenceSettings& settings) {
  std::map<std::string, Class> classes;
  for (const LabelledCloud& cloud : clouds) {
    const Points unit = Normalisation::of(cloud.points).apply(cloud.points);
    classes[cloud.label].push_back(
        {unit, GaussianMixture(unit, settings.components, settings.seed)});
  }
  return classes;
}

/// Mean over pairs drawn from the classes; the same class twice gives two different clouds.
double drawnMean(const Class& a, const Class& b, int pairs, Random& random) {
  const bool within = &a == &b;
  if (within && a.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  double sum = 0.0;
  for (int pair = 0; pair < pairs; ++pair) {
    const auto i = random.below(static_cast<std::int64_t>(a.size()));
    auto j = random.below(static_cast<std::int64_t>(b.size()) - (within ? 1 : 0));
    if (within && j >= i) ++j;
    const FittedCloud& x = a[static_cast<std::size_t>(i)];
    const FittedCloud& y = b[static_cast<std::size_t>(j)];
    sum += mixtureDivergence(x.points, x.mixture, y.points, y.mixture);
  }
  return sum / pairs;
}

}  // namespace

DivergenceTable divergenceTable(const std::vector<LabelledCloud>& clouds,
                                const DivergenceSettings& settings) {
  const std::map<std::string, Class> classes = fitAll(clouds, settings);
  DivergenceTable table;
  const auto count = static_cast<Eigen::Index>(classes.size());
  table.mean.resize(count, count);
  table.spread.resize(count, count);
  Random random(settings.seed);
  Eigen::Index row = 0;
  for (auto a = classes.begin(); a != classes.end(); ++a, ++row) {
    table.labels.push_back(a->first);
    Eigen::Index column = row;
    for (auto b = a; b != classes.end(); ++b, ++column) {
      Eigen::ArrayXd means(settings.repeats);
      for (int k = 0; k < settings.repeats; ++k) {
        means[k] = drawnMean(a->second, b->second, settings.pairs, random);
      }
      table.mean(row, column) = table.mean(column, row) = means.mean();
      table.spread(row, column) = table.spread(column, row) =
          std::sqrt((means - means.mean()).square().mean());
    }
  }
  return table;
}

std::string toMarkdown(const DivergenceTable& table) {
  std::string header = "| L_mc |", rule = "|---|", rows;
  for (std::size_t i = 0; i < table.labels.size(); ++i) {
    header += " " + table.labels[i] + " |";
    rule += "---|";
    rows += "| " + table.labels[i] + " |";
    for (std::size_t j = 0; j < table.labels.size(); ++j) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(j);
      char cell[64] = " no two surfaces |";
      if (std::isfinite(table.mean(row, column))) {
        std::snprintf(cell, sizeof(cell), " %.2f ± %.2f |", table.mean(row, column),
                      table.spread(row, column));
      }
      rows += cell;
    }
    rows += "\n";
  }
  return header + "\n" + rule + "\n" + rows;
}

}  // namespace unirit
