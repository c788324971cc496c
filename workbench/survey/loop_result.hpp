// SPDX-License-Identifier: Apache-2.0
// What a survey says of one loop, as the file loops/TAG.json that it is resumed and joined from.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "record/import/constant_period.hpp"

namespace loopwarden::workbench {

struct SurveySettings {
  double window_s = 8.0 * 3600.0;
  std::vector<double> co_range{};  // empty: from the data
  std::string kind{};              // empty: by the site's rules, else from the tag
};

// By the site's rules; else 0 to 100, 0 to 1 or 4 to 20, as the values and the unit suggest.
std::vector<double> likely_co_range(const record::Imported& imported);

// Judges all windows. `imported` is used up.
nlohmann::json judge_loop(record::Imported imported, const SurveySettings& settings);

}  // namespace loopwarden::workbench
