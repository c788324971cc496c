// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace loopwarden::base {

// Calls body(0) to body(count - 1), each once, on up to `threads` threads, and returns when all are
// done. The body writes its result to a place of its own, so that nothing depends on the number of
// threads. `progress`, where given, is told how many are done, by one thread at a time. The first
// exception out of a body ends the work early and is thrown on.
void parallel_for(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& body,
                  const std::function<void(std::size_t done)>& progress = {});

}  // namespace loopwarden::base
