// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "daemon/supervision/explanation.hpp"

namespace loopwarden::daemon {

// Reads explanation.json, which `loopwarden explain` wrote into the alarm's evidence. Throws
// std::runtime_error if the file is missing or invalid.
Explanation read_explanation(const std::filesystem::path& folder);

// The verdict of an alarm that could not be explained. Its sentence gives the reason.
inline constexpr const char* kNotExplained = "not_explained";
// Writes explanation.json into the explanation's `folder`: alarm, times and sentence. Throws
// std::runtime_error.
void write_not_explained(const Explanation& explanation);

// Replaces the file's text. After a failure or crash the file has either the old or the new text.
// Throws std::runtime_error.
void replace_text(const std::filesystem::path& file, const std::string& text);

}  // namespace loopwarden::daemon
