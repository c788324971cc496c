// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::page {

// A line typed at the terminal, which shows nothing of it. Throws std::runtime_error where there is no terminal.
std::string ask_unseen(const char* prompt);

}  // namespace loopwarden::page
