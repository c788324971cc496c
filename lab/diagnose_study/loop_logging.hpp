// SPDX-License-Identifier: Apache-2.0
// What a historian makes of a signal.
#pragma once

#include <cstddef>
#include <vector>

#include "model/numeric/random.hpp"

namespace loopwarden::studies {

// Straight lines between the points that a historian would keep.
void compress(std::vector<double>& x, double deviation);
// Exception reporting: a value is kept until it has moved by more than the dead band.
void hold_last(std::vector<double>& x, double dead_band);
void round_to(std::vector<double>& x, double step);

// Samples at which the log repeats the one before, in stretches: `share` of all.
std::vector<char> stale_samples(numeric::Random& random, std::size_t count, double share,
                                double mean_length);
void repeat_last(std::vector<double>& x, const std::vector<char>& stale);

}  // namespace loopwarden::studies
