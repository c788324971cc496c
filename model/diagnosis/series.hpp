// SPDX-License-Identifier: Apache-2.0
// Small tools on equally spaced samples. All take finite values; an empty series gives 0 or an empty
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
double mean(std::span<const double> x);
double variance(std::span<const double> x);  // about the mean, divided by the count
double correlation(std::span<const double> x,
                   std::span<const double> y);  // -1 to 1; 0 without spread
// Fourth moment over the squared second, about the mean: square wave 1, sine 1.5, ramps 1.8, normal 3.
double kurtosis(std::span<const double> x);
double skewness(std::span<const double> x);
double quantile(Series x, double share);  // share 0 to 1

// Less its straight line by least squares.
Series detrended(std::span<const double> x);
// Mean over the samples up to `half_width` away on either side; fewer at the ends.
Series moving_mean(std::span<const double> x, std::size_t half_width);
// What the moving mean over `window` samples leaves. A cycle of less than half the window keeps its
// shape, slower movement goes.
Series high_passed(std::span<const double> x, std::size_t window);
// Means over consecutive blocks of `factor` samples; a shorter block at the end is left out.
Series block_means(std::span<const double> x, std::size_t factor);
// x(k + lag) - x(k - lag), the ends held.
Series central_difference(std::span<const double> x, std::size_t lag);

}  // namespace loopwarden::diagnosis
