// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/valve_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/diagnosis/limits.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::diagnosis {
namespace {

constexpr std::size_t kDeadTimes = 9;
constexpr std::size_t kMostSamples = 1200;  // more only take time
// Time constants over the period. The last one represents an integrating process.
constexpr std::array<double, 6> kTimeConstants{0.0, 0.04, 0.1, 0.25, 0.7, -1.0};
constexpr std::array<double, 8> kBands{0.15, 0.25, 0.4, 0.55,
                                       0.7,  0.8,  0.9, 0.97};  // of CO's range
constexpr std::array<double, 4> kJumps{0.15, 0.4, 0.7, 1.0};    // of s

struct Best {
  double free = 0.0;
  double whitened = 0.0;
  double integrating = 0.0;  // free, of integrating processes
  double other = 0.0;        // free, of the others
  double dead_time = 0.0;    // samples, of the best free fit
  double time_constant = 0.0;
};

struct Target {
  Series y;
  double action = 1.0;
  double period = 1.0;
  std::size_t window = 0;
};

// Returns R^2 of y on z delayed by d samples; 0 if the gain has the wrong sign.
double explained(const Series& y, const Series& z, std::size_t d, std::size_t from, double action,
                 double whitening) {
  // Four parallel sums: with a single sum each addition waits for the one before.
  constexpr std::size_t kLanes = 4;
  std::array<double, kLanes> yy_of{};
  std::array<double, kLanes> yz_of{};
  std::array<double, kLanes> zz_of{};
  const auto add = [&](std::size_t k, std::size_t lane) {
    const double e = y[k] - whitening * y[k - 1];
    const double x = z[k - d] - whitening * z[k - d - 1];
    yy_of[lane] += e * e;
    yz_of[lane] += e * x;
    zz_of[lane] += x * x;
  };
  std::size_t k = from;
  for (; k + kLanes <= y.size(); k += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) add(k + lane, lane);
  }
  for (; k < y.size(); ++k) add(k, 0);
  const double yy = (yy_of[0] + yy_of[1]) + (yy_of[2] + yy_of[3]);
  const double yz = (yz_of[0] + yz_of[1]) + (yz_of[2] + yz_of[3]);
  const double zz = (zz_of[0] + zz_of[1]) + (zz_of[2] + zz_of[3]);
  if (yz * action <= 0.0 || zz <= 1e-12 * yy) return 0.0;
  return yz * yz / (yy * zz);
}

Best fit_process(const Series& v, const Target& target) {
  Best best;
  const auto longest = static_cast<std::size_t>(Limits::kLongestDeadTime * target.period + 0.5);
  const std::size_t from = longest + 2;
  if (target.y.size() < 2 * from) return best;
  for (const double time_constant : kTimeConstants) {
    const bool integrating = time_constant < 0.0;
    const double a = integrating           ? 1.0
                     : time_constant > 0.0 ? std::exp(-1.0 / (time_constant * target.period))
                                           : 0.0;
    const double b = integrating ? 1.0 / target.period : 1.0 - a;
    Series z(v.size());
    double state = integrating ? 0.0 : v.front();
    for (std::size_t k = 0; k < v.size(); ++k) z[k] = state = a * state + b * v[k];
    z = high_passed(z, target.window);
    std::size_t last = kMostSamples;  // no dead time yet
    for (std::size_t i = 0; i < kDeadTimes; ++i) {
      const std::size_t d = longest * i / (kDeadTimes - 1);
      if (d == last) continue;
      last = d;
      const double free = explained(target.y, z, d, from, target.action, 0.0);
      if (free > best.free) {
        best.dead_time = static_cast<double>(d);
        best.time_constant = integrating ? 3.0 : time_constant;
      }
      best.free = std::max(best.free, free);
      double& of_kind = integrating ? best.integrating : best.other;
      of_kind = std::max(of_kind, free);
      best.whitened = std::max(best.whitened,
                               explained(target.y, z, d, from, target.action, Limits::kWhitening));
    }
  }
  return best;
}

}  // namespace

ValveFit fit_valve(const Prepared& prepared, double action) {
  ValveFit fit;
  const std::size_t n = std::min(prepared.co.size(), kMostSamples);
  Target target;
  target.y.assign(prepared.pv_fast.begin(),
                  prepared.pv_fast.begin() + static_cast<std::ptrdiff_t>(n));
  target.action = action < 0.0 ? -1.0 : 1.0;
  target.period = prepared.period;
  target.window = prepared.window;
  // CO about its slow course: the steps of a valve scale with the cycle, not with the drift.
  Series u(prepared.co.begin(), prepared.co.begin() + static_cast<std::ptrdiff_t>(n));
  const double level = u.front();
  for (double& value : u) value -= level;

  const Best linear = fit_process(u, target);
  fit.linear = {linear.free, linear.whitened};
  fit.integrating_gain = linear.integrating - linear.other;
  fit.dead_time = linear.dead_time / prepared.period;

  Series fast(prepared.output.begin(), prepared.output.begin() + static_cast<std::ptrdiff_t>(n));
  const double range =
      (numeric::quantile(fast, 0.97) - numeric::quantile(fast, 0.03)) * prepared.co_scale;
  if (range <= 0.0) return fit;
  Series v(n);
  for (const double band : kBands) {
    const double s = band * range;
    effects::Backlash play(s);
    play.reset(u.front());
    for (std::size_t k = 0; k < n; ++k) v[k] = play.step(u[k]);
    const Best with_play = fit_process(v, target);
    if (with_play.free > fit.backlash.free) fit.backlash_deadband = s;
    fit.backlash.free = std::max(fit.backlash.free, with_play.free);
    fit.backlash.whitened = std::max(fit.backlash.whitened, with_play.whitened);
    for (const double share : kJumps) {
      effects::StictionChoudhury law({.s = s, .j = share * s});
      law.reset(u.front());
      for (std::size_t k = 0; k < n; ++k) v[k] = law.step(u[k]);
      const Best sticking = fit_process(v, target);
      if (sticking.free > fit.stiction.free) {
        fit.s = s;
        fit.j = share * s;
        fit.band_share = band;
        fit.pole_share = sticking.time_constant;
        fit.integrating_gain = sticking.integrating - sticking.other;
      }
      fit.stiction.free = std::max(fit.stiction.free, sticking.free);
      fit.stiction.whitened = std::max(fit.stiction.whitened, sticking.whitened);
    }
  }
  fit.output_range = range;
  return fit;
}

}  // namespace loopwarden::diagnosis
