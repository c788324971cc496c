// SPDX-License-Identifier: Apache-2.0
// Statistics of samples.
//
//   mean       m = (1/n) sum x
//   variance   (1/n) sum (x - m)^2               deviation  its root
//   rms        sqrt((1/n) sum x^2)
//   skewness   (1/n) sum (x - m)^3 / variance^1.5: 0 for a symmetric distribution
//   kurtosis   (1/n) sum (x - m)^4 / variance^2: square wave 1, sine 1.5, ramp 1.8, normal 3
//   correlation  of pairs, -1 to 1
//   quantile   the sorted value at index p (n - 1), rounded to the nearest index, halves up:
//              always one of the values
//   median     the quantile for p = 0.5: the greater of two middle values
//
//   x  any one unit, finite     p  0 to 1
//
// Errors: no exceptions. The result is 0 for an empty `x`. Correlation, skewness and kurtosis are 0
// if all values are equal.
// Limits: missing samples must be removed first. Quantiles aren't interpolated. Small samples
// aren't corrected (n, not n - 1).
//
// Sources: Hyndman and Fan, American Statistician 50 (1996) 361-365 (a quantile that is a sorted
// value); Huber, Robust Statistics (Wiley 1981), section 5.1 (kNormalOverMad).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace loopwarden::numeric {

// Ratio of the standard deviation of normal values to the median of |x - median|. That median stays
// valid if up to half of the values are outliers.
inline constexpr double kNormalOverMad = 1.4826;

double mean(std::span<const double> x);
double variance(std::span<const double> x);
double deviation(std::span<const double> x);
double rms(std::span<const double> x);
double skewness(std::span<const double> x);
double kurtosis(std::span<const double> x);
// Returns the rms of x - y over the samples at which y is finite; 0 if y has no finite sample. `x`
// and `y` have the same size.
double rms_apart(std::span<const double> x, std::span<const double> y);
// `x` and `y` have the same size.
double correlation(std::span<const double> x, std::span<const double> y);

double quantile(std::vector<double> x, double p);
double median(std::vector<double> x);
// Returns the same quantile without a copy or an allocation, and reorders the values.
double quantile_in_place(std::span<double> x, double p) noexcept;

// The least and the greatest finite value; 0 and 0 if no value is finite.
struct Range {
  double low = 0.0;
  double high = 0.0;
};
Range range_of(std::span<const double> x) noexcept;

// Returns the 95 % confidence interval of a share, 0 to 1, after `hits` of `of` trials. It is 0 to
// 1 if `of` is 0.
// Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927).
Range wilson_interval(std::size_t hits, std::size_t of) noexcept;

}  // namespace loopwarden::numeric
