// SPDX-License-Identifier: Apache-2.0
// Ranks the results of the loops: groups of loops that oscillate together, the order, and the next
// step.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "workbench/survey/outcomes.hpp"

namespace loopwarden::workbench {

// Returns {"loops": [...], "groups": [...], "failed": [...], "outcomes": as precision_json()},
// worst first. The result does not depend on the order of `loops`.
//
//   score = 60 probability of a named valve effect + 20 if the loop oscillates for another cause
//           + 15 variability + 10 share of CO at its limits + 10 (1 - share in automatic)
//
// A finding that a fitter rejected has 0 of the 60 points until its size has grown by half. An
// undecided loop is ranked by its other terms. Equal scores are sorted by tag.
nlohmann::json join_survey(std::vector<nlohmann::json> loops, nlohmann::json failed,
                           const std::vector<FitterAnswer>& outcomes);

// The next step with an explanation: repair (seen), test the valve (likely), tune, look upstream,
// nothing, look closer.
struct NextStep {
  std::string what;
  std::string why;
};
NextStep next_step(const nlohmann::json& loop);

std::string survey_csv(const nlohmann::json& survey);

}  // namespace loopwarden::workbench
