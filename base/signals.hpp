// SPDX-License-Identifier: Apache-2.0
// Waits for signals at a place of the program's choosing.
#pragma once

#include <chrono>
#include <initializer_list>

namespace loopwarden::base {

// Blocks signals in this thread and in threads that it starts later. Call it before the first
// thread is started.
void block_signals(std::initializer_list<int> numbers);

// Waits up to `patience` for one of these blocked signals. Returns the signal, which may already be
// pending; 0: none arrived.
int wait_for_signal(std::initializer_list<int> numbers, std::chrono::nanoseconds patience);

}  // namespace loopwarden::base
