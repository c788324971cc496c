// SPDX-License-Identifier: Apache-2.0
// Detects whether a signal oscillates, and its period.
//
// The intervals between the zero crossings of the autocorrelation are half periods T_i / 2; noise
// adds to lag 0 only, so they show an oscillation hidden in noise. Regularity r = mean(T) / (3
// std(T)); r > 1 is an oscillation (N. F. Thornhill, B. Huang and H. Zhang, J. Process Control 13,
// 2003). At most the first ten intervals count.
//
// Limits: it sees one oscillation at a time; slow drift must have been removed.
#pragma once

#include <cstddef>
#include <span>

namespace loopwarden::diagnosis {

struct Oscillation {
  double period = 0.0;      // samples; 0: never crosses zero
  double regularity = 0.0;  // r, at most 20
  double peak = 0.0;        // autocorrelation after one period, -1 to 1
  std::size_t intervals = 0;
};

Oscillation find_oscillation(std::span<const double> x);

// The time scale of a signal's movement: the oscillation that stands out most after slow movement
// has been removed on scales from the whole record down to a twentieth of it.
struct TimeScale {
  Oscillation oscillation;
  double score = 0.0;  // regularity (at most 3) times root of its share of variance
};
TimeScale find_time_scale(std::span<const double> x);

}  // namespace loopwarden::diagnosis
