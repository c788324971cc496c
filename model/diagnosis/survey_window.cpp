// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/survey_window.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/diagnosis/limits.hpp"
#include "model/numeric/statistics.hpp"
#include "model/diagnosis/variability.hpp"

namespace loopwarden::diagnosis {
namespace {

bool known(double v) noexcept { return std::isfinite(v); }

// RMS of white noise on a signal whose own curvature is smaller: median of squares, 0.455 for one
// degree of freedom.
double signal_noise(std::span<const double> y) {
  std::vector<double> squares;
  for (std::size_t k = 1; k + 1 < y.size(); ++k) {
    const double d2 = y[k + 1] - 2.0 * y[k] + y[k - 1];
    if (known(d2)) squares.push_back(d2 * d2);
  }
  return squares.empty() ? 0.0
                         : std::sqrt(numeric::quantile_in_place(squares, 0.5) / (6.0 * 0.455));
}

// Computes the travel of CO in moves that are larger than its noise. A turn counts when CO has
// returned by more than the noise.
void travel_of(std::span<const double> co, double hours, WindowFindings& window) {
  const double step = std::max(3.0 * signal_noise(co), 1e-9);
  double anchor = std::numeric_limits<double>::quiet_NaN();
  double travel = 0.0;
  double reversals = 0.0;
  int direction = 0;
  for (const double v : co) {
    if (!known(v)) continue;
    if (!known(anchor)) anchor = v;
    const double move = v - anchor;
    if (std::abs(move) < step) continue;
    const int now = move > 0.0 ? 1 : -1;
    if (direction != 0 && now != direction) reversals += 1.0;
    direction = now;
    travel += std::abs(move);
    anchor = v;
  }
  if (hours <= 0.0) return;
  window.travel_per_hour = travel / hours;
  window.reversals_per_hour = reversals / hours;
}

void error_of(const numeric::LoopView& s, double hours, WindowFindings& window) {
  window.error = std::numeric_limits<double>::quiet_NaN();
  if (s.sp.empty()) return;
  double sum = 0.0;
  std::size_t n = 0;
  std::size_t crossings = 0;
  double before = 0.0;
  const double dead = window.noise;
  for (std::size_t k = 0; k < s.pv.size(); ++k) {
    const double e = s.pv[k] - s.sp[k];
    if (!known(e)) continue;
    sum += e * e;
    ++n;
    if (std::abs(e) <= dead) continue;
    if (before * e < 0.0) ++crossings;
    before = e;
  }
  if (n > 0) window.error = std::sqrt(sum / static_cast<double>(n));
  if (hours > 0.0) window.crossings_per_hour = static_cast<double>(crossings) / hours;
}

}  // namespace

WindowFindings judge_window(const numeric::LoopView& s) {
  WindowFindings window;
  const std::size_t n = s.pv.size();
  const double hours = static_cast<double>(n) * s.period_s / 3600.0;
  std::vector<double> pv(s.pv.begin(), s.pv.end());
  std::vector<double> co(s.co.begin(), s.co.end());
  std::size_t moded = 0;
  std::size_t automatic = 0;
  std::size_t complete = 0;
  std::size_t at_limit = 0;
  const double near = Limits::kNearEnd * (s.co_high - s.co_low);
  for (std::size_t k = 0; k < n; ++k) {
    if (known(pv[k]) && known(co[k])) {
      ++complete;
      if (co[k] <= s.co_low + near || co[k] >= s.co_high - near) ++at_limit;
    }
    if (s.automatic.empty() || !known(s.automatic[k])) continue;
    ++moded;
    if (s.automatic[k] != 0.0) {
      ++automatic;
    } else {
      pv[k] = co[k] = std::numeric_limits<double>::quiet_NaN();
    }
  }
  const auto share = [](std::size_t part, std::size_t whole) {
    return whole == 0 ? std::numeric_limits<double>::quiet_NaN()
                      : static_cast<double>(part) / static_cast<double>(whole);
  };
  window.automatic = share(automatic, moded);
  window.complete = share(complete, n);
  window.saturated = complete == 0 ? 0.0 : share(at_limit, complete);
  window.noise = signal_noise(pv);
  error_of(s, hours, window);
  travel_of(co, hours, window);
  const std::size_t dead_time = dead_time_samples(co, pv, Limits::kMostDeadTime);
  window.dead_time_s = static_cast<double>(dead_time) * s.period_s;
  std::vector<double> error = pv;
  for (std::size_t k = 0; k < n && !s.sp.empty(); ++k) error[k] -= s.sp[k];
  window.variability = variability(error, dead_time);
  return window;
}

std::optional<std::size_t> cause_since(std::span<const diagnosis::Cause> causes,
                                       diagnosis::Cause cause) {
  std::size_t first = causes.size();
  while (first > 0 && causes[first - 1] == cause) --first;
  return first < causes.size() ? std::optional(first) : std::nullopt;
}

}  // namespace loopwarden::diagnosis
