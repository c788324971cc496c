// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/boosted_trees.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/numeric/random.hpp"

namespace loopwarden::lab {
namespace {

using diagnosis::Tree;

constexpr std::size_t kGroups = 32;
constexpr std::size_t kNodes = 7;

struct Sums {
  double gradient = 0.0;
  double weight = 0.0;
  double gain(double ridge) const { return gradient * gradient / (weight + ridge); }
};

double leaf_value(const Tree& tree, const std::vector<double>& row) {
  std::size_t node = 0;
  while (node < kNodes) {
    const bool right = row[tree.feature[node]] > static_cast<double>(tree.threshold[node]);
    node = 2 * node + (right ? 2 : 1);
  }
  return static_cast<double>(tree.leaf[node - kNodes]);
}

}  // namespace

Binned bin(const std::vector<std::vector<double>>& rows) {
  Binned binned;
  const std::size_t columns = rows.empty() ? 0 : rows.front().size();
  binned.edges.resize(columns);
  binned.rows.assign(rows.size(), std::vector<std::uint8_t>(columns));
  std::vector<double> values(rows.size());
  for (std::size_t e = 0; e < columns; ++e) {
    for (std::size_t i = 0; i < rows.size(); ++i) values[i] = rows[i][e];
    std::sort(values.begin(), values.end());
    auto& edges = binned.edges[e];
    for (std::size_t b = 1; b < kGroups; ++b) {
      const auto edge = static_cast<float>(values[b * values.size() / kGroups]);
      if (edges.empty() || edge > edges.back()) edges.push_back(edge);
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto at = std::lower_bound(
          edges.begin(), edges.end(), rows[i][e],
          [](float edge, double value) { return static_cast<double>(edge) < value; });
      binned.rows[i][e] = static_cast<std::uint8_t>(at - edges.begin());
    }
  }
  return binned;
}

Tree grow(const Binned& binned, std::span<const std::size_t> rows,
          std::span<const std::size_t> columns, std::span<const double> gradient,
          std::span<const double> weight, const TrainingSettings& settings) {
  Tree tree;
  // Without a split, all cases take the left branch.
  tree.threshold.fill(std::numeric_limits<float>::max());
  std::array<std::vector<std::size_t>, 2 * kNodes + 1> members;
  members[0].assign(rows.begin(), rows.end());
  for (std::size_t node = 0; node < kNodes; ++node) {
    Sums all;
    for (const std::size_t i : members[node]) {
      all.gradient += gradient[i];
      all.weight += weight[i];
    }
    double best_gain = 1e-9;
    std::size_t best_column = 0;
    std::size_t best_bin = 0;
    bool found = false;
    for (const std::size_t e : columns) {
      std::array<Sums, kGroups> histogram{};
      for (const std::size_t i : members[node]) {
        Sums& s = histogram[binned.rows[i][e]];
        s.gradient += gradient[i];
        s.weight += weight[i];
      }
      Sums left;
      for (std::size_t b = 0; b < binned.edges[e].size(); ++b) {
        left.gradient += histogram[b].gradient;
        left.weight += histogram[b].weight;
        const Sums right{all.gradient - left.gradient, all.weight - left.weight};
        if (left.weight < settings.least_weight || right.weight < settings.least_weight) continue;
        const double gain =
            left.gain(settings.ridge) + right.gain(settings.ridge) - all.gain(settings.ridge);
        if (gain > best_gain) {
          best_gain = gain;
          best_column = e;
          best_bin = b;
          found = true;
        }
      }
    }
    if (found) {
      tree.feature[node] = static_cast<std::uint8_t>(best_column);
      tree.threshold[node] = binned.edges[best_column][best_bin];
    }
    for (const std::size_t i : members[node]) {
      const bool right = found && binned.rows[i][best_column] > best_bin;
      members[2 * node + (right ? 2 : 1)].push_back(i);
    }
  }
  for (std::size_t leaf = 0; leaf < tree.leaf.size(); ++leaf) {
    Sums s;
    for (const std::size_t i : members[kNodes + leaf]) {
      s.gradient += gradient[i];
      s.weight += weight[i];
    }
    tree.leaf[leaf] = static_cast<float>(settings.rate * s.gradient / (s.weight + settings.ridge));
  }
  return tree;
}

std::vector<double> boosted_logits(const std::vector<std::vector<double>>& rows,
                                   const std::vector<char>& positive,
                                   const std::vector<double>& weights,
                                   const TrainingSettings& settings) {
  std::vector<double> logits(rows.size(), 0.0);
  std::vector<std::size_t> trained;
  double total = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (weights[i] <= 0.0) continue;
    trained.push_back(i);
    total += weights[i];
  }
  if (trained.empty()) return logits;
  const double scale = static_cast<double>(trained.size()) / total;
  const Binned binned = bin(rows);
  numeric::Random random(settings.seed);
  std::vector<double> gradient(rows.size(), 0.0);
  std::vector<double> curvature(rows.size(), 0.0);
  for (std::size_t round = 0; round < settings.rounds; ++round) {
    std::vector<std::size_t> seen;
    for (const std::size_t i : trained) {
      if (random.uniform() < settings.rows) seen.push_back(i);
      const double p = 1.0 / (1.0 + std::exp(-logits[i]));
      gradient[i] = scale * weights[i] * ((positive[i] != 0 ? 1.0 : 0.0) - p);
      curvature[i] = scale * weights[i] * std::max(p * (1.0 - p), 1e-6);
    }
    std::vector<std::size_t> columns;
    for (std::size_t e = 0; e < binned.edges.size(); ++e) {
      if (random.uniform() < settings.columns) columns.push_back(e);
    }
    const Tree tree = grow(binned, seen, columns, gradient, curvature, settings);
    for (std::size_t i = 0; i < rows.size(); ++i) logits[i] += leaf_value(tree, rows[i]);
  }
  return logits;
}

}  // namespace loopwarden::lab
