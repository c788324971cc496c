// SPDX-License-Identifier: Apache-2.0
// Memory allocation that fails when a test requests it.
#pragma once

#include <atomic>

namespace loopwarden::tests {

// Number of allocations of the calling thread before one throws std::bad_alloc. Negative: all
// succeed.
extern thread_local int fail_allocation_after;
// Number of allocations that threw.
extern std::atomic<int> allocations_failed;

}  // namespace loopwarden::tests
