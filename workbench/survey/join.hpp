// SPDX-License-Identifier: Apache-2.0
// From the results of the loops to the ranked list: groups of loops that swing together, order, what to do next.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "workbench/survey/outcomes.hpp"

namespace loopwarden::workbench {

// {"loops": [...], "groups": [...], "failed": [...], "outcomes": as precision_json()}: worst first. The same list whatever the order of `loops`.
//
//   score = 60 probability of a valve effect that is named + 20 if the loop swings for another cause
//           + 15 variability + 10 share of CO at its limits + 10 (1 - share in automatic)
//
// A finding that a fitter rejected has none of the 60 until its size has grown by half.
// A loop that can't be told stands by what is left of these. Equal scores stand by tag.
nlohmann::json join_survey(std::vector<nlohmann::json> loops, nlohmann::json failed,
                           const std::vector<FitterAnswer>& outcomes);

// One of repair (seen), test the valve (likely), tune, look upstream, nothing, look closer; and a sentence.
struct NextStep {
  std::string what;
  std::string why;
};
NextStep next_step(const nlohmann::json& loop);

std::string survey_csv(const nlohmann::json& survey);

}  // namespace loopwarden::workbench
