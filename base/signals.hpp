// SPDX-License-Identifier: Apache-2.0
// Signals that a program takes at a place of its choosing.
#pragma once

#include <chrono>
#include <initializer_list>

namespace loopwarden::base {

// In this thread and those that it makes from now on. Of a program with others: before the first of them.
void block_signals(std::initializer_list<int> numbers);

// One of these, which are blocked, that has come or comes within `patience`; 0: none.
int wait_for_signal(std::initializer_list<int> numbers, std::chrono::nanoseconds patience);

}  // namespace loopwarden::base
