// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::page {

// Returns a line typed at the terminal without echo. Throws std::runtime_error without a terminal.
std::string ask_unseen(const char* prompt);

}  // namespace loopwarden::page
