// SPDX-License-Identifier: Apache-2.0
// A proposed test in words, and as the contents of next_test.yaml.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/gap/result.hpp"
#include "daemon/protocol/planned_test/test_plan_file.hpp"

namespace loopwarden::workbench {

using protocol::PlannedExplanation;
using protocol::TestPlanFile;
using protocol::write_test_plan;

// Returns the names of the explanations between which the test decides.
std::vector<std::string> names_of(const gap::NextTest& test);
// Returns "stiction, backlash or creep", with `last` before the last name.
std::string joined(const std::vector<std::string>& names, const char* last);
// What to move, by how much and how long.
std::string test_sentence(const estimator::TestPlan& plan);
// Returns the proposed test in words: the move, the change of PV that each explanation predicts,
// how often it decides, its duration, its deviations and who may allow it. `names`: of the
// explanations, in the order of the plan.
std::string proposed_test_text(const estimator::TestPlan& plan,
                               const std::vector<std::string>& names);
// Means of `values` over at most `count` stretches of equal length.
std::vector<double> means_of(const std::vector<double>& values, std::size_t count);
// Changes of PV from the start of the test, PV units: the largest one, and the one at the end.
// Median of each explanation.
std::vector<std::array<double, 2>> outcomes_of(const estimator::TestPlan& plan);
// Who may allow a test whose move adds this share of the span to the deviations of PV: technician
// (1 %), operator (3 %) or test day.
const char* allowed_by(double pv_share);
// The next larger class, or an empty text.
std::string next_class_sentence(const gap::NextTest& test);
// The plan of result.next_test, without loop, time and files. It ends the test at twice the
// deviations that were simulated.
TestPlanFile plan_file(const gap::Result& result);

}  // namespace loopwarden::workbench
