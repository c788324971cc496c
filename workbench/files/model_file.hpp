// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "model/plant/loop_model.hpp"

namespace loopwarden::workbench {

// Reads a loop model and prints what is wrong with it. Empty after an error.
std::optional<plant::LoopModel> load_model(const std::string& path);

// The file as it is, for reports; empty where it can't be read.
std::string text_of(const std::string& path);

// In one line: kind where it integrates, gain, lags, dead time.
std::string process_text(const plant::ProcessParameters& process);

}  // namespace loopwarden::workbench
