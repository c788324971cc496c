// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::base {

// Prepares the process for a real-time thread: memory locked and never given back to the kernel.
// Returns an empty text, or in plain words what was refused and what that means.
std::string lock_memory();

// Touches the calling thread's stack so that it causes no page fault later.
void prefault_stack() noexcept;

}  // namespace loopwarden::base
