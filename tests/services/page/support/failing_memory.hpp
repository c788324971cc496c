// SPDX-License-Identifier: Apache-2.0
// Memory that is short when a test says so.
#pragma once

#include <atomic>

namespace loopwarden::tests {

// Of the calling thread: after so many more allocations one throws std::bad_alloc; negative: none does.
extern thread_local int fail_allocation_after;
// How many have thrown.
extern std::atomic<int> allocations_failed;

}  // namespace loopwarden::tests
