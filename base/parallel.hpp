// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace loopwarden::base {

// Calls body(0) to body(count - 1), each once, on up to `threads` threads, and returns when all are
// done. Each call must write its result to its own place, so that the result does not depend on the
// number of threads. `progress`, if set, receives the number of finished calls, from one thread at
// a time. The first exception of a body ends the work early and is rethrown.
void parallel_for(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& body,
                  const std::function<void(std::size_t done)>& progress = {});

}  // namespace loopwarden::base
