// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

// Returns the model as a file that reads back with bit-identical numbers. Controller settings
// without a key in model files are not written: set-point limits and ramps, and limits other than
// the output's range. `heading` is put first, as comment lines.
std::string write_model(const plant::LoopModel& model, const std::string& heading = "");

// Return the words used in files.
const char* to_text(control::AntiWindup anti_windup);
const char* to_text(control::JacketForm form);

}  // namespace loopwarden::config
