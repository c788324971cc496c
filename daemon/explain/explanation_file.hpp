// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "daemon/supervision/explanation.hpp"

namespace loopwarden::daemon {

// What `loopwarden explain` left in the alarm's evidence as explanation.json. Throws std::runtime_error for a folder
// without one, or with what is none.
Explanation read_explanation(const std::filesystem::path& folder);

// The verdict of an alarm that nothing explains; its sentence says why.
inline constexpr const char* kNotExplained = "not_explained";
// As explanation.json in `folder` of it: alarm, times and sentence. Throws std::runtime_error.
void write_not_explained(const Explanation& explanation);

// The file has its old text or the new one. Throws std::runtime_error.
void replace_text(const std::filesystem::path& file, const std::string& text);

}  // namespace loopwarden::daemon
