// SPDX-License-Identifier: Apache-2.0
// Judges one loop for a survey. The result is kept as loops/TAG.json, from which the survey resumes
// and joins.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "record/import/constant_period.hpp"

namespace loopwarden::workbench {

struct SurveySettings {
  double window_s = 8.0 * 3600.0;
  std::vector<double> co_range{};  // empty: from the data
  std::string kind{};              // empty: by the site's rules, otherwise from the tag
};

// Returns the CO range by the site's rules, otherwise 0 to 100, 0 to 1 or 4 to 20, depending on the
// values and the unit.
std::vector<double> likely_co_range(const record::Imported& imported);

// Judges all windows. Consumes `imported`.
nlohmann::json judge_loop(record::Imported imported, const SurveySettings& settings);

}  // namespace loopwarden::workbench
