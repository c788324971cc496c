// SPDX-License-Identifier: Apache-2.0
// Effects of a historian on a signal.
#pragma once

#include <cstddef>
#include <vector>

#include "model/numeric/random.hpp"

namespace loopwarden::lab {

// Replaces the signal by straight lines between the points that a historian would keep.
void compress(std::vector<double>& x, double deviation);
// Exception reporting: holds a value until it has moved by more than the dead band.
void hold_last(std::vector<double>& x, double dead_band);
void round_to(std::vector<double>& x, double step);

// Returns the samples at which the log repeats the previous one, in stretches: `share` of all
// samples.
std::vector<char> stale_samples(numeric::Random& random, std::size_t count, double share,
                                double mean_length);
void repeat_last(std::vector<double>& x, const std::vector<char>& stale);

}  // namespace loopwarden::lab
