// SPDX-License-Identifier: Apache-2.0
// What the holdout says of the names that were given.
#pragma once

#include <cstdint>

namespace loopwarden::gap {

enum class Proof : std::uint8_t {
  holds,    // the names stand as they are
  partly,   // they stand, with less confidence
  refuted,  // they are taken back
};

}  // namespace loopwarden::gap
