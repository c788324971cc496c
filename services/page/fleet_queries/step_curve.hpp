// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace loopwarden::fleet {

// What a value's history says of one step of time.
struct StepRow {
  int step = 0;       // -1: before the first
  double high = 0.0;  // highest in it
  double last = 0.0;  // what it ended with
};

inline constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

// The highest value of each step. A step without a row has the value before it, since a box says only what changes;
// kNotKnown before the first one. `rows`: in the order of steps; those beyond `steps` are left out.
std::vector<double> step_curve(const std::vector<StepRow>& rows, std::size_t steps);

}  // namespace loopwarden::fleet
