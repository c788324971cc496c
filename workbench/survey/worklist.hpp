// SPDX-License-Identifier: Apache-2.0
// The work list of a survey: one row per order, for people and for maintenance systems
// (docs/reference/worklist.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "workbench/survey/changes.hpp"
#include "workbench/survey/costs.hpp"

namespace loopwarden::workbench {

// Returns the orders of a survey, sorted by confidence, then by the mean of the saving, the largest
// first, then by rank. `survey`: from join_survey.
// One order serves all loops that follow its loop. A loop that is undecided and does not swing has
// no order. Each order:
//   {"order": 1, "id", "action", "tag", "source_tag", "area", "who", "shutdown", "minutes",
//    "saving_low", "saving_high" per year, "currency", "confidence": high, medium or low,
//    "probability", "finding", "short_text", "text", "also_steadies": [tags], "from", "to", "rank"}
nlohmann::json worklist(const nlohmann::json& survey, const Costs& costs,
                        const LoopWeights& weights = {});
std::string worklist_csv(const nlohmann::json& orders);

// Returns "300 to 2700".
std::string saving_text(const nlohmann::json& order);
// Returns the assumptions as JSON for survey.json and the report.
nlohmann::json costs_json(const Costs& costs);

}  // namespace loopwarden::workbench
