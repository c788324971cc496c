// SPDX-License-Identifier: Apache-2.0
// What most commands do alike.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <utility>

#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {

// Ends the command: the text goes to the error output.
template <class... Args>
[[noreturn]] void fail(ExitCode code, fmt::format_string<Args...> text, Args&&... args) {
  throw CommandError(code, fmt::format(text, std::forward<Args>(args)...));
}

void show_json(const nlohmann::json& result);
// An answer of the daemon, as it sent it.
void show_answer(nlohmann::json answer);

// What --jobs asks for; 0: one a core. One in the background.
unsigned threads(unsigned jobs);
// Calls `body` for 0 to count - 1 on this many threads.
using ParallelFor =
    std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;
ParallelFor on_threads(unsigned count);

}  // namespace loopwarden::workbench
