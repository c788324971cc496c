// SPDX-License-Identifier: Apache-2.0
// Helpers that most commands use.
#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <utility>

#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {

// Throws CommandError with this text, which ends the command and appears on standard error.
template <class... Args>
[[noreturn]] void fail(ExitCode code, fmt::format_string<Args...> text, Args&&... args) {
  throw CommandError(code, fmt::format(text, std::forward<Args>(args)...));
}

void show_json(const nlohmann::json& result);
// Prints an answer of the daemon as the daemon sent it.
void show_answer(nlohmann::json answer);

// Returns the number of threads for --jobs; 0 means one per core. In the background it is 1.
unsigned threads(unsigned jobs);
// Calls `body` for 0 to count - 1 on a fixed number of threads.
using ParallelFor =
    std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;
ParallelFor on_threads(unsigned count);

}  // namespace loopwarden::workbench
