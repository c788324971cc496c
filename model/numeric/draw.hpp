// SPDX-License-Identifier: Apache-2.0
// Random draws for the cases of studies and of training.
#pragma once

#include <cmath>

#include "model/numeric/random.hpp"

namespace loopwarden::numeric {

// Returns a log-uniform number from `low` to `high`: every factor is equally likely, so that 1 to 2
// is drawn as often as 4 to 8. 0 < low <= high, both in the same unit.
inline double log_uniform(Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}

// Returns true with probability `share`, 0 to 1.
inline bool chance(Random& random, double share) { return random.uniform() < share; }

}  // namespace loopwarden::numeric
