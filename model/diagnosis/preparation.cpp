// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/preparation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace loopwarden::diagnosis {
namespace {

constexpr std::size_t kLongestGap = 10;        // samples that are filled
constexpr double kLeastShareOfOnePart = 0.35;  // of the record, for a stretch at one set point
constexpr std::size_t kLeastStretch = 150;     // samples
constexpr double kLeastMovement = 1e-4;        // of the CO span
constexpr double kUpset = 2.5;                 // times the range from 5 to 95 %: cut back
constexpr double kSettlingShare = 0.1;         // of a stretch after a step that is left out

struct Part {
  std::size_t from = 0;
  std::size_t to = 0;
  std::size_t size() const { return to - from; }
};

bool complete(const RoutineRecord& r, std::size_t k) {
  return std::isfinite(r.pv[k]) && std::isfinite(r.co[k]);
}

// The longest part without a gap of more than kLongestGap samples, beginning and ending complete.
Part longest_part(const RoutineRecord& r) {
  Part best;
  Part part;
  bool open = false;
  for (std::size_t k = 0; k < r.pv.size(); ++k) {
    if (!complete(r, k)) continue;
    if (!open || k - part.to >= kLongestGap) part.from = k;
    open = true;
    part.to = k + 1;
    if (part.size() > best.size()) best = part;
  }
  return best;
}

Series filled(std::span<const double> x) {
  Series out(x.begin(), x.end());
  std::size_t last = 0;
  bool any = false;
  for (std::size_t k = 0; k < out.size(); ++k) {
    if (!std::isfinite(out[k])) continue;
    for (std::size_t j = any ? last + 1 : 0; j < k; ++j) {
      const double share = static_cast<double>(j - last) / static_cast<double>(k - last);
      out[j] = any ? out[last] + share * (out[k] - out[last]) : out[k];
    }
    last = k;
    any = true;
  }
  for (std::size_t k = last + 1; any && k < out.size(); ++k) out[k] = out[last];
  return any ? out : Series{};
}

// The longest stretch of a set point that moves in steps; all of it where there is none long enough.
Part steady_stretch(const Series& sp) {
  Part best;
  std::size_t from = 0;
  for (std::size_t k = 1; k <= sp.size(); ++k) {
    if (k < sp.size() && sp[k] == sp[from]) continue;
    if (k - from > best.size()) best = {from, k};
    from = k;
  }
  const Part all{0, sp.size()};
  if (best.size() == all.size()) return all;
  if (best.from > 0) {
    best.from += static_cast<std::size_t>(kSettlingShare * static_cast<double>(best.size()));
  }
  const bool long_enough =
      best.size() >= kLeastStretch &&
      static_cast<double>(best.size()) >= kLeastShareOfOnePart * static_cast<double>(all.size());
  return long_enough ? best : all;
}

Series slice(const Series& x, Part part) {
  if (x.empty()) return {};
  return {x.begin() + static_cast<std::ptrdiff_t>(part.from),
          x.begin() + static_cast<std::ptrdiff_t>(part.to)};
}

double share_at_limits(const Series& co) {
  const auto [low, high] = std::minmax_element(co.begin(), co.end());
  const double tolerance = 1e-3 * (*high - *low);
  std::size_t low_count = 0;
  std::size_t high_count = 0;
  for (const double u : co) {
    low_count += u <= *low + tolerance ? 1U : 0U;
    high_count += u >= *high - tolerance ? 1U : 0U;
  }
  // Either end is reached once by any signal.
  const std::size_t resting = std::max(low_count, high_count);
  return static_cast<double>(resting) / static_cast<double>(co.size());
}

// Share of variance in the differences of neighbours that a smooth movement can't explain.
double noise_share(const Series& x) {
  const double v = variance(detrended(x));
  if (v <= 0.0 || x.size() < 4) return 0.0;
  double sum = 0.0;
  for (std::size_t k = 3; k < x.size(); ++k) {
    const double third = x[k] - 3.0 * x[k - 1] + 3.0 * x[k - 2] - x[k - 3];
    sum += third * third;
  }
  return std::min(1.0, sum / (20.0 * static_cast<double>(x.size() - 3)) / v);
}

// Share of the samples at which PV is exactly what it was: coarse resolution, or an analyser.
double held_share(const Series& x) {
  std::size_t held = 0;
  for (std::size_t k = 1; k < x.size(); ++k) held += x[k] == x[k - 1] ? 1U : 0U;
  return static_cast<double>(held) / static_cast<double>(x.size());
}

// To a standard deviation of 1, upsets cut back; returns the scale.
double scale(Series& x) {
  const double half_range = (quantile(x, 0.95) - quantile(x, 0.05)) / 2.0;
  if (half_range > 0.0) {
    const double middle = (quantile(x, 0.95) + quantile(x, 0.05)) / 2.0;
    const double reach = kUpset * half_range;
    for (double& v : x) v = std::clamp(v, middle - reach, middle + reach);
  }
  const double deviation = std::sqrt(variance(x));
  if (deviation <= 0.0) return 1.0;
  for (double& v : x) v /= deviation;
  return deviation;
}

bool moves(const Series& x, double least) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  return *high - *low > least;
}

// PV follows an SP that moves: SP explains some of PV, and PV stays about it.
bool follows(const Series& pv, const Series& sp) {
  if (sp.empty() || variance(sp) <= 0.0) return false;
  Series error(pv.size());
  for (std::size_t k = 0; k < pv.size(); ++k) error[k] = pv[k] - sp[k];
  const double spread = std::sqrt(variance(pv) + variance(sp));
  return correlation(pv, sp) > 0.3 && std::abs(mean(error)) < 2.0 * spread;
}

}  // namespace

Prepared prepare(const RoutineRecord& record) {
  Prepared p;
  if (record.pv.size() != record.co.size()) {
    p.refusal = "PV and CO differ in length";
    return p;
  }
  Part part = longest_part(record);
  if (part.size() < kLeastSamples) {
    p.refusal = "fewer than " + std::to_string(kLeastSamples) +
                " samples of PV and CO in a row without a long gap";
    return p;
  }
  Series pv = filled(record.pv.subspan(part.from, part.size()));
  Series co = filled(record.co.subspan(part.from, part.size()));
  Series sp;
  if (record.sp.size() == record.pv.size()) sp = filled(record.sp.subspan(part.from, part.size()));
  if (!sp.empty()) {
    const Part steady = steady_stretch(sp);
    if (steady.size() < sp.size() && follows(pv, sp)) {
      pv = slice(pv, steady);
      co = slice(co, steady);
      sp = slice(sp, steady);
      part.from += steady.from;
    }
  }
  p.from = part.from;
  p.used = pv.size();
  if (!moves(co, kLeastMovement * (record.co_high - record.co_low))) {
    p.refusal = "the controller output does not move: manual, or nothing to correct";
    return p;
  }
  if (!moves(pv, 0.0)) {
    p.refusal = "PV is frozen";
    return p;
  }
  p.set_point_active = follows(pv, sp);
  Series error = pv;
  if (p.set_point_active) {
    for (std::size_t k = 0; k < error.size(); ++k) error[k] -= sp[k];
  }
  p.share_at_limit = share_at_limits(co);
  p.fast_share = noise_share(pv);
  p.held_share = held_share(pv);

  const TimeScale by_pv = find_time_scale(error);
  const TimeScale by_co = find_time_scale(co);
  const TimeScale& chosen = by_pv.score > by_co.score ? by_pv : by_co;
  double period = chosen.oscillation.period;
  if (period <= 0.0) period = static_cast<double>(pv.size()) / 4.0;
  period = std::min(period, static_cast<double>(pv.size()) / 2.0);

  p.factor = std::max<std::size_t>(1, static_cast<std::size_t>(period / kSamplesPerPeriod));
  p.pv = block_means(pv, p.factor);
  p.co = block_means(co, p.factor);
  error = block_means(error, p.factor);
  p.period = period / static_cast<double>(p.factor);
  p.period_s = period * record.sample_time_s;
  p.cycles = static_cast<double>(p.pv.size()) / p.period;
  p.window = static_cast<std::size_t>(kWindowPeriods * p.period + 0.5);

  p.error = high_passed(error, p.window);
  p.output = high_passed(p.co, p.window);
  p.pv_fast = high_passed(p.pv, p.window);
  scale(p.error);
  p.co_scale = scale(p.output);
  scale(p.pv_fast);
  p.pv_oscillation = find_oscillation(p.error);
  p.co_oscillation = find_oscillation(p.output);
  return p;
}

}  // namespace loopwarden::diagnosis
