// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

namespace loopwarden::numeric {

// Calls body(0) to body(count - 1), in any order or at once, and returns when all are done. What is computed does not
// depend on how.
using ParallelFor =
    std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;

}  // namespace loopwarden::numeric
