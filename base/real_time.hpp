// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace loopwarden::base {

// Prepares the process for a real-time thread: locks its memory and never returns memory to the
// kernel. Returns an empty text, or a message with the refused step and its consequence.
std::string lock_memory();

// Touches the calling thread's stack so that it causes no page fault later.
void prefault_stack() noexcept;

}  // namespace loopwarden::base
