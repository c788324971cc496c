// SPDX-License-Identifier: Apache-2.0
// Fits the table of model/diagnosis/classifier.hpp to simulated cases.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/diagnosis/classifier.hpp"
#include "model/numeric/parallel.hpp"
#include "lab/diagnose_study/boosted_trees.hpp"

namespace loopwarden::lab {

struct LabelledFeatures {
  diagnosis::Features features{};
  diagnosis::Cause cause = diagnosis::Cause::none;
};

struct TrainedTable {
  std::array<float, diagnosis::kCauseCount> base{};
  std::vector<diagnosis::Tree> trees;
  diagnosis::TreeTable view() const { return {.base = base, .trees = trees}; }
};

// Trains a table. It does not depend on the implementation of `parallel`.
TrainedTable train(const std::vector<LabelledFeatures>& cases, const TrainingSettings& settings,
                   const numeric::ParallelFor& parallel);

// Returns the text of model/diagnosis/classifier.table.
std::string table_text(const TrainedTable& table, const std::string& provenance);

}  // namespace loopwarden::lab
