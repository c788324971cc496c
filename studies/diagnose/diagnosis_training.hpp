// SPDX-License-Identifier: Apache-2.0
// Fits the table of model/diagnosis/classifier.hpp to simulated cases.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "model/diagnosis/classifier.hpp"
#include "model/numeric/parallel.hpp"

namespace loopwarden::studies {

struct LabelledFeatures {
  diagnosis::Features features{};
  diagnosis::Cause cause = diagnosis::Cause::none;
};

struct TrainedTable {
  std::array<float, diagnosis::kCauseCount> base{};
  std::vector<diagnosis::Tree> trees;
  diagnosis::TreeTable view() const { return {.base = base, .trees = trees}; }
};

struct TrainingSettings {
  std::size_t rounds = 200;
  double rate = 0.07;         // share of each step that is taken
  double rows = 0.6;          // share of the cases that a round sees
  double columns = 0.4;       // share of the features that a tree may use
  double least_weight = 8.0;  // of a leaf, in units of p (1 - p)
  double ridge = 4.0;         // added to the weight of each leaf
  std::uint64_t seed = 1;
};

// The table does not depend on how `parallel` does it.
TrainedTable train(const std::vector<LabelledFeatures>& cases, const TrainingSettings& settings,
                   const numeric::ParallelFor& parallel);

// The text of model/diagnosis/classifier.table.
std::string table_text(const TrainedTable& table, const std::string& provenance);

}  // namespace loopwarden::studies
