// SPDX-License-Identifier: Apache-2.0
// A proposed test in words, and as the contents of next_test.yaml.
#pragma once

#include <string>

#include "model/gap/result.hpp"
#include "workbench/files/test_plan_file.hpp"

namespace loopwarden::workbench {

// "stiction or square disturbance"
std::string competing_names(const gap::NextTest& test);
// What to move, by how much and how long.
std::string test_sentence(const gap::NextTest& test);
// How often it decides, and how far PV and CO move.
std::string expected_sentence(const gap::NextTest& test);
// The next larger class, or an empty text.
std::string next_class_sentence(const gap::NextTest& test);
// The plan of result.next_test, without loop, time and files. It ends the test at twice the
// deviations that were simulated.
TestPlanFile plan_file(const gap::Result& result);

}  // namespace loopwarden::workbench
