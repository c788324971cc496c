// SPDX-License-Identifier: Apache-2.0
// Statistics of samples.
//
//   mean       m = (1/n) sum x
//   variance   (1/n) sum (x - m)^2               deviation  its root
//   rms        sqrt((1/n) sum x^2)
//   skewness   (1/n) sum (x - m)^3 / variance^1.5: 0 where values lie alike on both sides
//   kurtosis   (1/n) sum (x - m)^4 / variance^2: square wave 1, sine 1.5, ramp 1.8, normal 3
//   correlation  of pairs, -1 to 1
//   quantile   the sorted value at place p (n - 1), rounded to the nearest place, halves up: always one of
//              the values        median: p = 0.5, of two middle values the greater
//
//   x  any one unit, finite     p  0 to 1
//
// Errors: none. No values give 0; values without spread have correlation, skewness and kurtosis 0.
// What they can't do: missing samples (leave them out first); no interpolation between values, no
// correction of small samples (n, not n - 1).
//
// Sources: Hyndman and Fan, American Statistician 50 (1996) 361-365 (a quantile that is a sorted value);
// Huber, Robust Statistics (Wiley 1981), section 5.1 (kNormalOverMad).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace loopwarden::numeric {

// Deviation of normal values over the median of |x - median|, of which half of the values may be anything.
inline constexpr double kNormalOverMad = 1.4826;

double mean(std::span<const double> x);
double variance(std::span<const double> x);
double deviation(std::span<const double> x);
double rms(std::span<const double> x);
double skewness(std::span<const double> x);
double kurtosis(std::span<const double> x);
// Rms of x - y over the samples at which y is finite; 0 where there are none. As many of `y` as of `x`.
double rms_apart(std::span<const double> x, std::span<const double> y);
// As many of `y` as of `x`.
double correlation(std::span<const double> x, std::span<const double> y);

double quantile(std::vector<double> x, double p);
double median(std::vector<double> x);
// The same without a copy: leaves the values in another order. Doesn't allocate.
double quantile_in_place(std::span<double> x, double p) noexcept;

// From the least to the greatest of the finite values; 0 and 0 where there are none.
struct Range {
  double low = 0.0;
  double high = 0.0;
};
Range range_of(std::span<const double> x) noexcept;

// The 95 % interval of a share of which `hits` of `of` were counted, 0 to 1; of none all of it.
// Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927).
Range wilson_interval(std::size_t hits, std::size_t of) noexcept;

}  // namespace loopwarden::numeric
