// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/correlation.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>

#include "model/diagnosis/series_ops.hpp"
#include "model/numeric/two_columns.hpp"

namespace loopwarden::diagnosis {
namespace {

double correlation_at(std::span<const double> x, std::span<const double> y, std::ptrdiff_t lag) {
  const auto n = static_cast<std::ptrdiff_t>(x.size());
  double sum = 0.0;
  for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(0, -lag); k < std::min(n, n - lag); ++k) {
    sum += x[static_cast<std::size_t>(k + lag)] * y[static_cast<std::size_t>(k)];
  }
  return sum / static_cast<double>(n);
}

std::complex<double> at_frequency(std::span<const double> x, double period) {
  std::complex<double> sum = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double t = static_cast<double>(k);
    const double bell =
        0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (t + 0.5) / static_cast<double>(x.size()));
    sum += bell * x[k] * std::polar(1.0, -2.0 * std::numbers::pi * t / period);
  }
  return sum;
}

}  // namespace

CrossCorrelation cross_correlation(std::span<const double> error, std::span<const double> output,
                                   double period) {
  CrossCorrelation result;
  const auto reach = static_cast<std::ptrdiff_t>(period / 2.0 + 0.5);
  double odd = 0.0;
  double even = 0.0;
  for (std::ptrdiff_t lag = 0; lag <= reach; ++lag) {
    const double ahead = correlation_at(error, output, lag);
    const double behind = correlation_at(error, output, -lag);
    odd += (ahead - behind) * (ahead - behind);
    even += (ahead + behind) * (ahead + behind);
    result.strength = std::max({result.strength, std::abs(ahead), std::abs(behind)});
  }
  if (result.strength <= 0.0) return result;
  result.at_zero = correlation_at(error, output, 0) / result.strength;
  result.odd_share = odd / (odd + even);

  const auto length = static_cast<std::size_t>(2.0 * period + 0.5);
  std::complex<double> cross = 0.0;
  double error_power = 0.0;
  double output_power = 0.0;
  for (std::size_t from = 0; from + length <= error.size();
       from += std::max<std::size_t>(1, length / 2)) {
    const auto e = at_frequency(error.subspan(from, length), period);
    const auto u = at_frequency(output.subspan(from, length), period);
    cross += u * std::conj(e);
    error_power += std::norm(e);
    output_power += std::norm(u);
  }
  if (error_power > 0.0 && output_power > 0.0) {
    result.phase = std::arg(cross);
    result.coherence = std::norm(cross) / (error_power * output_power);
  }
  return result;
}

ControllerFit fit_controller(std::span<const double> error, std::span<const double> output,
                             double period) {
  // Over an eighth of a period, so that noise and the filter of the controller matter little.
  const auto lag = std::max<std::size_t>(1, static_cast<std::size_t>(period / 8.0 + 0.5));
  numeric::TwoColumns moves;
  Series sums(error.size() + 1, 0.0);
  for (std::size_t k = 0; k < error.size(); ++k) sums[k + 1] = sums[k] + error[k];
  for (std::size_t k = lag; k < error.size(); ++k) {
    const double proportional = error[k] - error[k - lag];
    const double integral = (sums[k + 1] - sums[k + 1 - lag]) / static_cast<double>(lag);
    const double moved = output[k] - output[k - lag];
    moves.add(proportional, integral, moved);
  }
  ControllerFit fit;
  if (moves.depends(1e-9) || moves.yy <= 0.0) return fit;
  const double gain = moves.p();
  const double rate = moves.q();
  fit.fit = std::clamp((gain * moves.ay + rate * moves.by) / moves.yy, 0.0, 1.0);
  const double by_gain = std::abs(gain) * std::sqrt(moves.aa);
  const double by_rate = std::abs(rate) * std::sqrt(moves.bb);
  fit.integral_share = by_rate / std::max(by_gain + by_rate, 1e-300);
  const double action = by_rate > by_gain ? rate : gain;
  fit.action = action < 0.0 ? 1.0 : -1.0;
  return fit;
}

}  // namespace loopwarden::diagnosis
