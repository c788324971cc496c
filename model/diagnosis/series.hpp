// SPDX-License-Identifier: Apache-2.0
// Small tools on equally spaced samples, beside the statistics of model/numeric. All take finite values; an empty series gives 0 or an empty
// series.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace loopwarden::diagnosis {

using Series = std::vector<double>;

// Sum of products of `count` values.
double dot(const double* a, const double* b, std::size_t count);
inline double dot(const Series& a, const double* b) { return dot(a.data(), b, a.size()); }

// Less its straight line by least squares.
Series detrended(std::span<const double> x);
// Mean over the samples up to `half_width` away on either side; fewer at the ends.
Series moving_mean(std::span<const double> x, std::size_t half_width);
// What the moving mean over `window` samples leaves. A cycle of less than half the window keeps its
// shape, slower movement goes.
Series high_passed(std::span<const double> x, std::size_t window);
// Means over consecutive blocks of `factor` samples; a shorter block at the end is left out.
Series block_means(std::span<const double> x, std::size_t factor);
// The median of each sample and its two neighbours: a single outlier goes, an edge stays. The ends are kept.
Series medians_of_three(std::span<const double> x);
// x(k + lag) - x(k - lag), the ends held.
Series central_difference(std::span<const double> x, std::size_t lag);

}  // namespace loopwarden::diagnosis
