// SPDX-License-Identifier: Apache-2.0
// Draws by which studies and training make their cases.
#pragma once

#include <cmath>

#include "model/numeric/random.hpp"

namespace loopwarden::numeric {

// Every factor is equally likely: between 1 and 2 as often as between 4 and 8. 0 < low <= high, both of one unit.
inline double log_uniform(Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}

inline bool chance(Random& random, double share) { return random.uniform() < share; }

}  // namespace loopwarden::numeric
