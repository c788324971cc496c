// SPDX-License-Identifier: Apache-2.0
#include "studies/diagnose/diagnosis_training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/numeric/random.hpp"

namespace loopwarden::studies {
namespace {

using diagnosis::kCauseCount;
using diagnosis::kFeatures;
using diagnosis::Tree;

constexpr std::size_t kBins = 32;
constexpr std::size_t kNodes = 7;

// A feature by its place among kBins groups of equal count: a split is then one of few.
struct Binned {
  std::array<std::vector<float>, kFeatures> edges;  // bin b holds values up to edges[b]
  std::vector<std::array<std::uint8_t, kFeatures>> rows;
};

Binned bin(const std::vector<LabelledFeatures>& cases) {
  Binned binned;
  binned.rows.resize(cases.size());
  std::vector<double> values(cases.size());
  for (std::size_t e = 0; e < kFeatures; ++e) {
    for (std::size_t i = 0; i < cases.size(); ++i) values[i] = cases[i].features[e];
    std::sort(values.begin(), values.end());
    auto& edges = binned.edges[e];
    for (std::size_t b = 1; b < kBins; ++b) {
      const auto edge = static_cast<float>(values[b * values.size() / kBins]);
      if (edges.empty() || edge > edges.back()) edges.push_back(edge);
    }
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const auto at = std::lower_bound(
          edges.begin(), edges.end(), cases[i].features[e],
          [](float edge, double value) { return static_cast<double>(edge) < value; });
      binned.rows[i][e] = static_cast<std::uint8_t>(at - edges.begin());
    }
  }
  return binned;
}

struct Sums {
  double gradient = 0.0;
  double weight = 0.0;
  double gain(double ridge) const { return gradient * gradient / (weight + ridge); }
};

Tree grow(const Binned& binned, const std::vector<std::size_t>& rows,
          const std::vector<std::size_t>& columns, const std::vector<double>& gradient,
          const std::vector<double>& weight, const TrainingSettings& settings) {
  Tree tree;
  // Where there is no split, everything goes left.
  tree.threshold.fill(std::numeric_limits<float>::max());
  std::array<std::vector<std::size_t>, 2 * kNodes + 1> members;
  members[0] = rows;
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
      std::array<Sums, kBins> histogram{};
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

}  // namespace

TrainedTable train(const std::vector<LabelledFeatures>& cases, const TrainingSettings& settings,
                   const numeric::ParallelFor& parallel) {
  TrainedTable table;
  const Binned binned = bin(cases);
  const std::size_t n = cases.size();
  std::array<double, kCauseCount> counts{};
  for (const LabelledFeatures& c : cases) counts[static_cast<std::size_t>(c.cause)] += 1.0;
  for (std::size_t c = 0; c < kCauseCount; ++c) {
    table.base[c] = static_cast<float>(std::log((counts[c] + 1.0) / static_cast<double>(n)));
  }
  std::vector<std::array<double, kCauseCount>> scores(n);
  for (auto& s : scores) {
    for (std::size_t c = 0; c < kCauseCount; ++c) s[c] = static_cast<double>(table.base[c]);
  }
  numeric::Random random(settings.seed);
  for (std::size_t round = 0; round < settings.rounds; ++round) {
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < n; ++i) {
      if (random.uniform() < settings.rows) rows.push_back(i);
    }
    std::array<std::vector<std::size_t>, kCauseCount> columns;
    for (auto& chosen : columns) {
      for (std::size_t e = 0; e < kFeatures; ++e) {
        if (random.uniform() < settings.columns) chosen.push_back(e);
      }
    }
    std::array<std::vector<double>, kCauseCount> gradients;
    std::array<std::vector<double>, kCauseCount> weights;
    for (std::size_t c = 0; c < kCauseCount; ++c) {
      gradients[c].resize(n);
      weights[c].resize(n);
    }
    for (std::size_t i = 0; i < n; ++i) {
      const double highest = *std::max_element(scores[i].begin(), scores[i].end());
      std::array<double, kCauseCount> p{};
      double sum = 0.0;
      for (std::size_t c = 0; c < kCauseCount; ++c) sum += p[c] = std::exp(scores[i][c] - highest);
      for (std::size_t c = 0; c < kCauseCount; ++c) {
        p[c] /= sum;
        const double wanted = static_cast<std::size_t>(cases[i].cause) == c ? 1.0 : 0.0;
        gradients[c][i] = wanted - p[c];
        weights[c][i] = std::max(p[c] * (1.0 - p[c]), 1e-6);
      }
    }
    std::array<Tree, kCauseCount> grown;
    parallel(kCauseCount, [&](std::size_t c) {
      grown[c] = grow(binned, rows, columns[c], gradients[c], weights[c], settings);
    });
    for (std::size_t c = 0; c < kCauseCount; ++c) {
      for (std::size_t i = 0; i < n; ++i) {
        scores[i][c] +=
            static_cast<double>(grown[c].leaf[diagnosis::leaf_of(grown[c], cases[i].features)]);
      }
      table.trees.push_back(grown[c]);
    }
  }
  return table;
}

std::string table_text(const TrainedTable& table, const std::string& provenance) {
  const auto list = [](const auto& values) {
    std::string text;
    for (const auto v : values) {
      text += fmt::format("{}{:.5g}", text.empty() ? "" : ",", static_cast<double>(v));
    }
    return text;
  };
  std::string text = "# SPDX-License-Identifier: Apache-2.0\n# Written by `" + provenance +
                     "`; not edited by hand.\n"
                     "# The base scores of the causes, then a tree a line: features, thresholds, "
                     "leaves.\n" +
                     list(table.base) + "\n";
  for (const Tree& tree : table.trees) {
    text += list(tree.feature) + " " + list(tree.threshold) + " " + list(tree.leaf) + "\n";
  }
  return text;
}

}  // namespace loopwarden::studies
