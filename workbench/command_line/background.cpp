// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/background.hpp"

#include <atomic>
#include <chrono>
#include <cstddef>

#include "base/child_process.hpp"

namespace loopwarden::workbench {
namespace {

constexpr std::size_t kMostMemory = 1UL << 30U;  // bytes
constexpr std::chrono::seconds kMostProcessorTime{900};

std::atomic<bool> background_of_process{false};

}  // namespace

void add_background(Command& command, bool& background) {
  command.flag("--background", background,
               "as the daemon runs it: one thread of idle priority, at most 1 GB of memory and 15 "
               "min of processor time, at most one sentence printed");
}

void work_in_background() {
  base::work_in_background(kMostMemory, kMostProcessorTime);
  background_of_process = true;
}

bool in_background() noexcept { return background_of_process; }

}  // namespace loopwarden::workbench
