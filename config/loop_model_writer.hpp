// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "model/plant/loop_model.hpp"

namespace loopwarden::config {

// The model as a file that reads back equal, bit for bit in its numbers. Controller settings that a
// model file has no key for (set-point limits and ramps, limits other than the output's range) are
// not written. Each line of `heading`, if any, comes first as a comment.
std::string write_model(const plant::LoopModel& model, const std::string& heading = "");

// As files have them.
const char* to_text(control::AntiWindup anti_windup);
const char* to_text(control::JacketForm form);

}  // namespace loopwarden::config
