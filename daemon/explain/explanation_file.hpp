// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "daemon/monitor/explanation.hpp"

namespace loopwarden::daemon {

// What `loopwarden explain` left in the alarm's evidence as explanation.json. Throws std::runtime_error for a folder
// without one, or with what is none.
Explanation read_explanation(const std::filesystem::path& folder);

}  // namespace loopwarden::daemon
