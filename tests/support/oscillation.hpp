// SPDX-License-Identifier: Apache-2.0
// Measures of the visible shape of a cycling loop's trend.
#pragma once

#include <cstddef>
#include <vector>

namespace loopwarden::test {

// One cycle: the samples [begin, end).
struct Cycle {
  std::size_t begin = 0;
  std::size_t end = 0;
};

// Returns the cycles of a signal about `level`, each from one rise through it to the next. A rise
// counts only after the signal has been below by `depth`, so that noise at the crossing doesn't
// count.
std::vector<Cycle> find_cycles(const std::vector<double>& signal, double level, double depth);

// Medians over the cycles; 0 without any.
double period(const std::vector<Cycle>& cycles, double sample_time_s);  // s
double amplitude(const std::vector<double>& signal,
                 const std::vector<Cycle>& cycles);  // half range

// Fourth moment over the squared second, about the mean, over whole cycles; the median. It depends
// on the distribution of the values: square wave 1, sine 1.5, any ramps up and down (saw-tooth)
// 1.8.
double kurtosis(const std::vector<double>& signal, const std::vector<Cycle>& cycles);

// Share of a cycle within a tenth of its range around one of two levels, the medians of its upper
// and of its lower half of values; the median. Square wave 1, sine 0.4, ramps 0.4.
double share_at_two_levels(const std::vector<double>& signal, const std::vector<Cycle>& cycles);

double median(std::vector<double> values);

}  // namespace loopwarden::test
