// SPDX-License-Identifier: Apache-2.0
// The test that `diagnose` and `survey` propose for a valve, in words and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "model/diagnosis/deciding_test.hpp"

namespace loopwarden::workbench {

// What to do and what to expect, or why no test decides.
std::string deciding_test_text(const diagnosis::DecidingTest& test,
                               const std::vector<double>& co_range);
// `next_test` of diagnose and survey.
nlohmann::json deciding_test_json(const diagnosis::DecidingTest& test,
                                  const std::vector<double>& co_range);

}  // namespace loopwarden::workbench
