// SPDX-License-Identifier: Apache-2.0
// A proposed test in words, and as the file next_test.yaml.
#pragma once

#include <string>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

// "stiction or square disturbance"
std::string competing_names(const gap::NextTest& test);
// What to move, by how much and how long.
std::string test_sentence(const gap::NextTest& test);
// How often it decides, and how far PV and CO move.
std::string expected_sentence(const gap::NextTest& test);
// The next larger class, or an empty text.
std::string next_class_sentence(const gap::NextTest& test);
// next_test.yaml. `model`: the path of the loop model that the test was planned with.
std::string test_yaml(const gap::NextTest& test, const std::string& model);

}  // namespace loopwarden::workbench
