// SPDX-License-Identifier: Apache-2.0
// The probabilities of the hypotheses of a gap, for the terminal and the report.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "daemon/protocol/planned_test/test_plan_file.hpp"
#include "model/gap/result.hpp"

namespace loopwarden::workbench {

struct Bar {
  std::string title;  // for example "stiction + gain change"
  double probability = 0.0;
  bool named = true;  // effects of the catalogue
};

using protocol::title_of;

// Returns the `most` likeliest hypotheses, then the others as one bar, then the bar for no name of
// the catalogue, whose probability may be 0. Empty for an empty posterior.
std::vector<Bar> posterior_bars(const std::vector<gap::Probability>& posterior, std::size_t most);

}  // namespace loopwarden::workbench
