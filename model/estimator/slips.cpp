// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/slips.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/estimator/constants.hpp"
#include "model/numeric/statistics.hpp"

namespace loopwarden::estimator {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// Windows of the stem's estimate.
struct Window {
  std::size_t half;   // w
  std::size_t delay;  // samples
  std::size_t reach;  // 2 w
};

Window window_of(const LoopFacts& loop, double period_s) {
  const plant::ProcessParameters& process = loop.model.process;
  const double half_s = std::max(0.15 * loop.answer_s, 0.12 * process.time_constant_s);
  const auto half = static_cast<std::size_t>(std::max(2.0, half_s / period_s + 1e-6));
  return {half, static_cast<std::size_t>(process.dead_time_s / period_s + 1e-6), 2 * half};
}

// x^ of each sample; NaN where the window leaves the record.
std::vector<double> stem_of(const Observed& observed, const LoopFacts& loop, std::size_t samples,
                            const Window& w) {
  std::vector<double> stem(samples, kMissing);
  std::vector<double> sum(samples + 1, 0.0);
  std::vector<double> moment(samples + 1, 0.0);
  double last = observed.pv[0];
  for (std::size_t k = 0; k < samples; ++k) {
    if (observed.used[k]) last = observed.pv[k];
    sum[k + 1] = sum[k] + last;
    moment[k + 1] = moment[k] + static_cast<double>(k) * last;
  }
  const auto half = static_cast<double>(w.half);
  const double squares = half * (half + 1.0) * (2.0 * half + 1.0) / 3.0;
  const double gain = loop.model.process.gain;
  const double lag_s = loop.model.process.time_constant_s;
  for (std::size_t k = w.half + w.delay; k + w.half < samples; ++k) {
    const double total = sum[k + w.half + 1] - sum[k - w.half];
    const double slope =
        (moment[k + w.half + 1] - moment[k - w.half] - static_cast<double>(k) * total) /
        (squares * observed.period_s);
    stem[k - w.delay] = (total / (2.0 * half + 1.0) + lag_s * slope) / gain;
  }
  return stem;
}

// The smallest move of CO between neighbours, CO units.
double step_of(const std::vector<double>& co, std::size_t samples) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < samples; ++k) {
    const double move = std::abs(co[k] - co[k - 1]);
    if (move > 0.0) least = std::min(least, move);
  }
  return std::isfinite(least) ? least : 0.0;
}

}  // namespace

Slips find_slips(const Observed& observed, const LoopFacts& loop, std::size_t samples,
                 double noise_rms) {
  Slips out;
  out.direction.assign(samples, 0);
  out.coming.assign(samples, 0);
  out.rounding = step_of(observed.co, samples) / std::sqrt(12.0);
  const Window w = window_of(loop, observed.period_s);
  if (samples < 8 * w.reach + w.delay) return out;
  const std::vector<double> stem = stem_of(observed, loop, samples, w);
  const auto half = static_cast<double>(w.half);
  const double squares = half * (half + 1.0) * (2.0 * half + 1.0) / 3.0;
  const double deviation =
      noise_rms / std::abs(loop.model.process.gain) *
      (loop.model.process.time_constant_s / (observed.period_s * std::sqrt(squares)) + 0.3);
  const double least = std::max(kLimits.jump_noise * deviation, kLimits.least_jump * loop.co_span);

  std::vector<double> change(samples, 0.0);
  for (std::size_t k = w.reach; k + w.reach < samples; ++k) {
    const double d = stem[k + w.reach] - stem[k - w.reach];
    if (std::isfinite(d)) change[k] = d;
  }
  // The force follows CO by an actuator, whose delay is short against the window.
  std::vector<double> before[2], after[2];  // closing, opening
  const std::size_t around = 2 * w.reach;
  const auto lead = static_cast<std::size_t>(0.04 * loop.answer_s / observed.period_s + 1e-6);
  for (std::size_t k = around; k + around < samples; ++k) {
    const double size = std::abs(change[k]);
    if (!(size > least)) continue;
    bool highest = true;
    for (std::size_t i = k - around; i <= k + around && highest; ++i) {
      const double other = std::abs(change[i]);
      if (other > size || (other == size && i < k)) highest = false;
    }
    if (!highest) continue;
    const double way = change[k] > 0.0 ? 1.0 : -1.0;
    for (std::size_t i = k - std::min(k, lead); i <= std::min(samples - 1, k + w.reach); ++i) {
      out.direction[i] = static_cast<std::int8_t>(way);
    }
    for (std::size_t i = k - std::min(k, 2 * around); i < k; ++i) {
      out.coming[i] = static_cast<std::int8_t>(way);
    }
    const double moved = observed.co[k + w.reach] - observed.co[k - w.reach];
    if (std::abs(moved) > 0.35 * size) continue;
    const std::size_t opening = way > 0.0 ? 1 : 0;
    before[opening].push_back(way * (observed.co[k] - stem[k - w.reach]));
    after[opening].push_back(way * (observed.co[k] - stem[k + w.reach]));
  }
  out.count = before[0].size() + before[1].size();
  if (before[0].empty() || before[1].empty()) return out;
  // The mean of both directions does not depend on the level of PV.
  out.static_friction = 0.5 * (numeric::median(before[0]) + numeric::median(before[1]));
  if (out.static_friction <= 0.0) return out;
  out.remaining =
      0.5 * (numeric::median(after[0]) + numeric::median(after[1])) / out.static_friction;
  return out;
}

double follow_slips(effects::StictionInertial& law, double static_friction, const Slips& slips,
                    std::ptrdiff_t later, std::span<double> stem) noexcept {
  const auto at = [&](const std::vector<std::int8_t>& direction, std::size_t k) {
    const std::ptrdiff_t i = static_cast<std::ptrdiff_t>(k) + later;
    return i >= 0 && i < std::ssize(direction) ? direction[static_cast<std::size_t>(i)] : 0;
  };
  const double early = std::min(0.9, kLimits.early + 2.0 * slips.rounding / static_friction);
  const double varies =
      std::hypot(kLimits.friction_varies * static_friction, slips.rounding);  // CO units
  double penalty = 0.0;
  double last = 0.0;  // force at the previous sample of the same rest
  for (std::size_t k = 0; k < stem.size(); ++k) {
    const double force = stem[k] - law.position();
    const bool rested = law.at_rest();
    const int way = force > 0.0 ? 1 : -1;
    const double share = at(slips.direction, k) == way ? 1.0 - early
                         : at(slips.coming, k) == way  ? 1.0 + early
                                                       : 1.0;
    stem[k] = law.step_with_friction(stem[k], share);
    if (!rested) continue;
    const double size = std::abs(force);
    if (size <= share * static_friction) {
      last = size;
      continue;
    }
    // A slip before the law's own moment, or after it.
    const double off = size < static_friction
                           ? size - static_friction
                           : std::max(0.0, std::min(last, size) - static_friction);
    const double deviations = off / varies;
    penalty += 0.5 * deviations * deviations;
    last = 0.0;
  }
  return penalty;
}

}  // namespace loopwarden::estimator
