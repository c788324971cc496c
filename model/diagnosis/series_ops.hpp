// SPDX-License-Identifier: Apache-2.0
// Small tools for equally spaced samples, in addition to the statistics of model/numeric. All take
// finite values. An empty series gives 0 or an empty series.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace loopwarden::diagnosis {

using Series = std::vector<double>;

// Returns the sum of products of `count` values.
double dot(const double* a, const double* b, std::size_t count);
inline double dot(const Series& a, const double* b) { return dot(a.data(), b, a.size()); }

// Returns x without its straight line by least squares.
Series detrended(std::span<const double> x);
// Returns the mean over the samples up to `half_width` away on either side; fewer at the ends.
Series moving_mean(std::span<const double> x, std::size_t half_width);
// Returns x without its moving mean over `window` samples. A cycle of less than half the window
// keeps its shape, slower movement is removed.
Series high_passed(std::span<const double> x, std::size_t window);
// Returns means over consecutive blocks of `factor` samples; a shorter block at the end is left
// out.
Series block_means(std::span<const double> x, std::size_t factor);
// Returns the median of each sample and its two neighbours: removes a single outlier, keeps an
// edge. The ends are kept.
Series medians_of_three(std::span<const double> x);
// Returns x(k + lag) - x(k - lag), the ends held.
Series central_difference(std::span<const double> x, std::size_t lag);

}  // namespace loopwarden::diagnosis
