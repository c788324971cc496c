// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace loopwarden::numeric {

// Calls body(0) to body(count - 1), in any order or in parallel, and returns when all calls are
// done. The results don't depend on the order.
using ParallelFor =
    std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;

}  // namespace loopwarden::numeric
