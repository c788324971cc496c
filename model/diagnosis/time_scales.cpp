// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/time_scales.hpp"

#include <algorithm>

#include "model/diagnosis/limits.hpp"
#include "model/diagnosis/series_ops.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::size_t kMostAcfSamples = 4000;  // longer records are averaged first

double autocovariance(const Series& x, std::size_t lag) {
  return dot(x.data() + lag, x.data(), x.size() - lag);
}

// Returns four times the first zero, or 0 without a zero.
double quadruple_zero(const Series& x, double power) {
  double before = power;
  for (std::size_t lag = 1; lag < x.size() / 2; ++lag) {
    const double now = autocovariance(x, lag);
    if (now <= 0.0) {
      return 4.0 * (static_cast<double>(lag) - 1.0 + before / (before - now));
    }
    before = now;
  }
  return 0.0;
}

double movement_period_of(const Series& x, double power, double quadruple) {
  const auto from = static_cast<std::size_t>(std::max(1.0, 0.6 * quadruple));
  const std::size_t to =
      std::min(static_cast<std::size_t>(1.6 * quadruple), x.size() > 2 ? x.size() - 2 : 0);
  double best = Limits::kPeakThatRepeats * power;
  double period = quadruple;
  double before = autocovariance(x, from - 1);
  double here = autocovariance(x, from);
  for (std::size_t lag = from; lag < to; ++lag) {
    const double after = autocovariance(x, lag + 1);
    if (here > best && here >= before && here >= after) {
      best = here;
      period = static_cast<double>(lag);
    }
    before = here;
    here = after;
  }
  return period;
}

}  // namespace

double movement_period(std::span<const double> co, std::span<const double> pv) {
  const std::size_t factor =
      (co.size() + kMostAcfSamples - 1) / std::max<std::size_t>(1, kMostAcfSamples);
  const std::size_t blocks = std::max<std::size_t>(1, factor);
  const Series output = detrended(block_means(co, blocks));
  const Series measured = detrended(block_means(pv, blocks));
  const double longest = static_cast<double>(output.size()) / 2.0;
  double shortest = 0.0;
  const Series* of = nullptr;
  for (const Series* x : {&output, &measured}) {
    const double power = autocovariance(*x, 0);
    if (power <= 0.0) continue;
    const double quadruple = quadruple_zero(*x, power);
    if (quadruple > 0.0 && (of == nullptr || quadruple < shortest)) {
      shortest = quadruple;
      of = x;
    }
  }
  double period = longest;
  if (of != nullptr) period = movement_period_of(*of, autocovariance(*of, 0), shortest);
  return std::clamp(period, std::min(4.0, longest), longest) * static_cast<double>(blocks);
}

}  // namespace loopwarden::diagnosis
