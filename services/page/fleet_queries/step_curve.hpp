// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace loopwarden::fleet {

// A value's history in one step of time.
struct StepRow {
  int step = 0;       // -1: before the first step
  double high = 0.0;  // highest value in the step
  double last = 0.0;  // value at the end of the step
};

inline constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();

// Returns the highest value of each step. A step without a row has the value before it, because a
// box reports only changes. Before the first value it is kNotKnown. `rows`: sorted by step; those
// beyond `steps` are ignored.
std::vector<double> step_curve(const std::vector<StepRow>& rows, std::size_t steps);

}  // namespace loopwarden::fleet
