// SPDX-License-Identifier: Apache-2.0
// Ranks the results of the loops: groups of loops that oscillate together, the order, and the next
// step.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "record/import/tag_rules.hpp"
#include "workbench/survey/outcomes.hpp"

namespace loopwarden::workbench {

// Returns {"loops": [...], "groups": [...], "failed": [...], "outcomes": as precision_json()},
// worst first. The result does not depend on the order of `loops`.
//
//   score = 60 probability of a named valve effect + 20 if the loop oscillates for another cause
//           + 15 variability + 10 share of CO at its limits + 10 (1 - share in automatic)
//
// A finding that a fitter rejected has 0 of the 60 points until its size has grown by half. An
// undecided loop is ranked by its other terms. Equal scores are sorted by tag. Healthy loops follow
// all others, and copies of a record (`duplicate_of`) are last.
//
// A group is in the order of its likely source only among loops that share a unit
// (site_names.hpp); `likely_source` is null for the others. Texts name loops by `shown`.
struct SiteSettings {
  std::vector<record::TagText> tags{};       // of the site's rules
  std::optional<record::TagPattern> area{};  // in place of the areas in the tags
};
nlohmann::json join_survey(std::vector<nlohmann::json> loops, nlohmann::json failed,
                           const std::vector<FitterAnswer>& outcomes,
                           const SiteSettings& site = {});

// Each loop has a next step with an explanation: repair (seen), test the valve (likely), tune, look
// upstream, check the transmitter, nothing, look closer.

std::string survey_csv(const nlohmann::json& survey);

}  // namespace loopwarden::workbench
