// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/diagnosis_training.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/numeric/random.hpp"

namespace loopwarden::lab {

using diagnosis::kCauseCount;
using diagnosis::kFeatures;
using diagnosis::Tree;

TrainedTable train(const std::vector<LabelledFeatures>& cases, const TrainingSettings& settings,
                   const numeric::ParallelFor& parallel) {
  TrainedTable table;
  std::vector<std::vector<double>> rows_of_cases;
  for (const LabelledFeatures& c : cases) {
    rows_of_cases.emplace_back(c.features.begin(), c.features.end());
  }
  const Binned binned = bin(rows_of_cases);
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

}  // namespace loopwarden::lab
