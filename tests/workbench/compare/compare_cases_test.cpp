// SPDX-License-Identifier: Apache-2.0
#include "workbench/compare/compare_cases.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

namespace loopwarden::workbench::compare_cases_test {

TEST_CASE("an integrating process without dead time is compared without other plants",
          "[compare]") {
  plant::LoopModel model;
  model.sample_time_s = 0.5;
  model.controller.pid.gains = {.kp = 2.0, .ki = 0.02};
  model.process = {.gain = 0.05, .dead_time_s = 0.0, .kind = plant::ProcessKind::integrating};
  // There are no other plants, because the rule for their controllers needs a dead time.
  const auto cases = compare_cases(model, ComparedPlants::own_and_others);
  REQUIRE_FALSE(cases.empty());
  CHECK(std::all_of(cases.begin(), cases.end(),
                    [](const CompareCase& one) { return one.plant == "own"; }));
  model.process.dead_time_s = 3.0;
  CHECK(compare_cases(model, ComparedPlants::own_and_others).size() > cases.size());
}

}  // namespace loopwarden::workbench::compare_cases_test
