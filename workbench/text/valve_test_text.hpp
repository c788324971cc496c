// SPDX-License-Identifier: Apache-2.0
// The test that `diagnose` and `survey` propose for a valve, in words and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "model/diagnosis/valve_test.hpp"

namespace loopwarden::workbench {

// What to do and what to expect, or why no test decides.
std::string valve_test_text(const diagnosis::ValveTest& test, const std::vector<double>& co_range);
// `next_test` of diagnose and survey.
nlohmann::json valve_test_json(const diagnosis::ValveTest& test,
                               const std::vector<double>& co_range);

}  // namespace loopwarden::workbench
