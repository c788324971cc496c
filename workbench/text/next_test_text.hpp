// SPDX-License-Identifier: Apache-2.0
// A proposed test in words, and as the file next_test.yaml.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

// "stiction or square disturbance"
std::string competing_names(const gap::NextTest& test);
// What to move, by how much and how long.
std::string test_sentence(const estimator::TestPlan& plan);
// "To decide between stiction and backlash: in automatic, ... Expected: ..."
std::string decision_sentence(const gap::NextTest& test);
// How often it decides, and how far PV and CO move.
std::string expected_sentence(const estimator::TestPlan& plan);
// Changes of PV from the start of the test, PV units: the largest one, and the one at the end.
// Median of each explanation.
std::vector<std::array<double, 2>> outcomes_of(const estimator::TestPlan& plan);
// Who may allow a test that moves PV by this share of its span: technician (1 %), operator (3 %) or
// test day.
const char* allowed_by(double pv_share);
// The next larger class, or an empty text.
std::string next_class_sentence(const gap::NextTest& test);
// next_test.yaml. `model`: the path of the loop model that the test was planned with.
std::string test_yaml(const gap::NextTest& test, const std::string& model);

}  // namespace loopwarden::workbench
