// SPDX-License-Identifier: Apache-2.0
// Trains the trees of a boosted classifier (J. H. Friedman, Annals of Statistics 29, 2001): those
// of `diagnose`, and one that distinguishes two populations.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/diagnosis/classifier.hpp"

namespace loopwarden::lab {

struct TrainingSettings {
  std::size_t rounds = 200;
  double rate = 0.07;         // share of each step that is applied
  double rows = 0.6;          // share of the cases used in a round
  double columns = 0.4;       // share of the features available to a tree
  double least_weight = 8.0;  // of a leaf, in units of p (1 - p)
  double ridge = 4.0;         // added to the weight of each leaf
  std::uint64_t seed = 1;
};

// Rows of features, each as its index among groups of equal count, so that the number of splits is
// small.
struct Binned {
  std::vector<std::vector<float>> edges;  // of each feature: bin b has values up to edges[b]
  std::vector<std::vector<std::uint8_t>> rows;
};
Binned bin(const std::vector<std::vector<double>>& rows);

// Adds a step along the gradient of the log-likelihood, on some rows and columns. At most 256
// columns.
diagnosis::Tree grow(const Binned& binned, std::span<const std::size_t> rows,
                     std::span<const std::size_t> columns, std::span<const double> gradient,
                     std::span<const double> weight, const TrainingSettings& settings);

// Returns log(p / (1 - p)) of the positive class for each row, from trees fitted to the rows with a
// weight above 0. The weights count as cases: they are scaled to a mean of 1 over those rows.
std::vector<double> boosted_logits(const std::vector<std::vector<double>>& rows,
                                   const std::vector<char>& positive,
                                   const std::vector<double>& weights,
                                   const TrainingSettings& settings);

}  // namespace loopwarden::lab
