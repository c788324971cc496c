// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/preparation.hpp"
#include "model/diagnosis/limits.hpp"
#include "model/numeric/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace loopwarden::diagnosis {
namespace {

constexpr const char* kLimitedReason =
    "in more than a third of the samples CO is at a limit, or does not move while PV stays far "
    "from SP: the valve is too small, SP is out of reach, or the controller is stopped or in "
    "manual";

struct Part {
  std::size_t from = 0;
  std::size_t to = 0;
  std::size_t size() const { return to - from; }
};

bool complete(const numeric::LoopView& r, std::size_t k) {
  return std::isfinite(r.pv[k]) && std::isfinite(r.co[k]);
}

// Returns the samples after which a resting CO is in manual or at a limit.
std::size_t standstill_length(std::size_t samples) {
  return std::max<std::size_t>(
      3 * Limits::kLongestGap,
      static_cast<std::size_t>(Limits::kManualShare * static_cast<double>(samples)));
}

// Returns the samples that count: complete, and not in a stretch in which CO rests for long.
std::vector<char> automatic_samples(const numeric::LoopView& r) {
  const std::size_t n = r.pv.size();
  const std::size_t standstill = standstill_length(n);
  std::vector<char> counts(n, 0);
  for (std::size_t from = 0; from < n;) {
    std::size_t to = from + 1;
    while (to < n && r.co[to] == r.co[from]) ++to;
    if (to - from < standstill) {
      for (std::size_t k = from; k < to; ++k) counts[k] = complete(r, k) ? 1 : 0;
    }
    from = to;
  }
  return counts;
}

// Returns the longest part without a gap of more than kLongestGap samples, beginning and ending
// complete.
Part longest_part(const numeric::LoopView& r) {
  const std::vector<char> counts = automatic_samples(r);
  Part best;
  Part part;
  bool open = false;
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (counts[k] == 0) continue;
    if (!open || k - part.to >= Limits::kLongestGap) part.from = k;
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

// Returns the samples at which CO rests at an end of its span. A long rest at the record's highest
// or lowest value counts too, because a limit holds CO there. The limits of a controller are seldom
// in the log.
std::vector<char> rests_at_limit(const Series& co, double span_low, double span_high) {
  const auto [low, high] = std::minmax_element(co.begin(), co.end());
  const double tolerance = Limits::kSameValue * (*high - *low);
  const double near_end = Limits::kNearEnd * (span_high - span_low);
  std::vector<char> resting(co.size(), 0);
  std::vector<Part> at_ends;
  Series between;  // lengths of the rests elsewhere, samples
  for (std::size_t from = 0; from < co.size();) {
    std::size_t to = from + 1;
    while (to < co.size() && std::abs(co[to] - co[from]) <= tolerance) ++to;
    if (co[from] <= *low + tolerance || co[from] >= *high - tolerance) {
      at_ends.push_back({.from = from, .to = to});
    } else {
      between.push_back(static_cast<double>(to - from));
    }
    from = to;
  }
  // A CO logged in coarse steps rests at every step.
  const double usual = between.empty() ? 1.0 : numeric::quantile(between, 0.9);
  for (const Part& part : at_ends) {
    if (static_cast<double>(part.size()) >=
        std::max(Limits::kLeastRest, Limits::kLongRest * usual)) {
      std::fill(resting.begin() + static_cast<std::ptrdiff_t>(part.from),
                resting.begin() + static_cast<std::ptrdiff_t>(part.to), 1);
    }
  }
  // If CO exceeds the given span, it has another span.
  const bool low_known = *low >= span_low - near_end;
  const bool high_known = *high <= span_high + near_end;
  for (std::size_t k = 0; k < co.size(); ++k) {
    if ((low_known && co[k] <= span_low + near_end) ||
        (high_known && co[k] >= span_high - near_end)) {
      resting[k] = 1;
    }
  }
  return resting;
}

// Returns the longest part away from the limits; a rest shorter than kLongestGap is part of it.
Part longest_free_part(const std::vector<char>& resting) {
  Part best;
  Part part;
  std::size_t rest = Limits::kLongestGap;
  for (std::size_t k = 0; k < resting.size(); ++k) {
    rest = resting[k] != 0 ? rest + 1 : 0;
    if (rest == 0) part.to = k + 1;
    if (rest >= Limits::kLongestGap) part = {.from = k + 1, .to = k + 1};
    if (part.size() > best.size()) best = part;
  }
  return best;
}

// Returns the share of variance in the differences of neighbours that a smooth movement can't
// explain.
double noise_share(const Series& x) {
  const double v = numeric::variance(detrended(x));
  if (v <= 0.0 || x.size() < 4) return 0.0;
  double sum = 0.0;
  for (std::size_t k = 3; k < x.size(); ++k) {
    const double third = x[k] - 3.0 * x[k - 1] + 3.0 * x[k - 2] - x[k - 3];
    sum += third * third;
  }
  return std::min(1.0, sum / (20.0 * static_cast<double>(x.size() - 3)) / v);
}

// Returns the share of the samples at which PV is exactly as before: coarse resolution, or an
// analyser.
double held_share(const Series& x) {
  std::size_t held = 0;
  for (std::size_t k = 1; k < x.size(); ++k) held += x[k] == x[k - 1] ? 1U : 0U;
  return static_cast<double>(held) / static_cast<double>(x.size());
}

// Scales to a standard deviation of 1 and cuts upsets back; returns the scale.
double scale(Series& x) {
  const double half_range = (numeric::quantile(x, 0.95) - numeric::quantile(x, 0.05)) / 2.0;
  if (half_range > 0.0) {
    const double middle = (numeric::quantile(x, 0.95) + numeric::quantile(x, 0.05)) / 2.0;
    const double reach = Limits::kUpset * half_range;
    for (double& v : x) v = std::clamp(v, middle - reach, middle + reach);
  }
  const double deviation = numeric::deviation(x);
  if (deviation <= 0.0) return 1.0;
  for (double& v : x) v /= deviation;
  return deviation;
}

bool moves(const Series& x, double least) {
  const auto [low, high] = std::minmax_element(x.begin(), x.end());
  return *high - *low > least;
}

// Returns whether PV follows a moving SP: SP explains some of PV, and PV stays near it.
bool follows(const Series& pv, const Series& sp) {
  if (sp.empty() || numeric::variance(sp) <= 0.0) return false;
  Series error(pv.size());
  for (std::size_t k = 0; k < pv.size(); ++k) error[k] = pv[k] - sp[k];
  const double spread = std::sqrt(numeric::variance(pv) + numeric::variance(sp));
  return numeric::correlation(pv, sp) > 0.3 && std::abs(numeric::mean(error)) < 2.0 * spread;
}

bool stands_still(std::span<const double> x) {
  const double* first = nullptr;
  for (const double& v : x) {
    if (!std::isfinite(v)) continue;
    if (first == nullptr) first = &v;
    if (v != *first) return false;
  }
  return first != nullptr;
}

// Returns whether PV is exactly the same for long while CO moves. An analyser or a historian holds
// it far shorter.
bool frozen(const Series& pv, const Series& co) {
  const auto longest =
      static_cast<std::size_t>(Limits::kFrozenShare * static_cast<double>(pv.size())) + 1;
  std::size_t since = 0;
  bool moving = false;
  for (std::size_t k = 1; k < pv.size(); ++k) {
    if (pv[k] != pv[since]) {
      since = k;
      moving = false;
      continue;
    }
    moving |= co[k] != co[since];
    if (moving && k + 1 - since >= longest) return true;
  }
  return false;
}

// Returns the largest absolute value of PV and SP, because PV alone may be zero all the time.
double scale_of(std::span<const double> pv, std::span<const double> sp) {
  double scale = 0.0;
  for (const std::span<const double> x : {pv, sp}) {
    for (const double v : x) {
      if (std::isfinite(v)) scale = std::max(scale, std::abs(v));
    }
  }
  return scale;
}

bool at_zero(std::span<const double> pv, double scale) {
  std::size_t known = 0;
  std::size_t zero = 0;
  for (const double v : pv) {
    if (!std::isfinite(v)) continue;
    ++known;
    zero += std::abs(v) <= Limits::kZero * scale ? 1U : 0U;
  }
  return static_cast<double>(zero) >= Limits::kNoFlowShare * static_cast<double>(known);
}

bool no_flow(const Series& pv, const Series& co, const Series& sp,
             const numeric::LoopView& record) {
  return moves(co, Limits::kTravel * (record.co_high - record.co_low)) &&
         at_zero(pv, scale_of(pv, sp));
}

// Returns the noise of PV between neighbours, PV units.
double noise_of(std::span<const double> pv) {
  Series steps;
  for (std::size_t k = 1; k < pv.size(); ++k) {
    if (std::isfinite(pv[k]) && std::isfinite(pv[k - 1])) {
      steps.push_back(std::abs(pv[k] - pv[k - 1]));
    }
  }
  return steps.empty() ? 0.0 : 1.05 * numeric::median(std::move(steps));  // 1.4826 / sqrt(2)
}

// Returns whether PV is off SP on one side during `part`, by more than its noise and `share` of the
// scale.
bool off_set_point(const numeric::LoopView& r, Part part, double share, double noises,
                   double scale) {
  Series error;
  for (std::size_t k = part.from; k < part.to; ++k) {
    const double e = r.pv[k] - r.sp[k];
    if (std::isfinite(e)) error.push_back(e);
  }
  if (error.empty()) return false;
  const double bound =
      std::max(share * scale, noises * noise_of(r.pv.subspan(part.from, part.size())));
  const double middle = numeric::median(error);
  const auto beyond = std::count_if(error.begin(), error.end(), [&](double e) {
    return std::abs(e) > bound && (e > 0.0) == (middle > 0.0);
  });
  return static_cast<double>(beyond) >= Limits::kOneSide * static_cast<double>(error.size());
}

// Returns the samples at which CO is at an end of its span, or rests for long while PV stays
// far from SP. A long rest does not count if PV is at SP (no error to correct) or at zero (the
// valve is shut, or there is no flow).
std::vector<char> limited_samples(const numeric::LoopView& r) {
  const std::size_t n = r.pv.size();
  std::vector<char> limited(n, 0);
  const auto [low, high] = numeric::range_of(r.co);
  const double near_end = Limits::kNearEnd * (r.co_high - r.co_low);
  const bool low_known = low >= r.co_low - near_end;
  const bool high_known = high <= r.co_high + near_end;
  const auto at_end = [&](double co) {
    return (low_known && co <= r.co_low + near_end) || (high_known && co >= r.co_high - near_end);
  };
  const double scale = scale_of(r.pv, r.sp);
  const bool has_sp = r.sp.size() == n;
  const std::size_t standstill = standstill_length(n);
  for (Part rest; rest.from < n; rest.from = rest.to) {
    rest.to = rest.from + 1;
    double least = r.co[rest.from];
    double most = least;
    for (; rest.to < n; ++rest.to) {
      if (!std::isfinite(r.co[rest.to])) break;
      least = std::min(least, r.co[rest.to]);
      most = std::max(most, r.co[rest.to]);
      if (!(most - least <= 2.0 * near_end)) break;
    }
    const std::span<const double> pv = r.pv.subspan(rest.from, rest.size());
    const bool end = at_end(r.co[rest.from]) && at_end(r.co[rest.to - 1]);
    bool counts = end;
    if (rest.size() >= standstill) {
      const double share = end ? Limits::kAtSetPoint : Limits::kFarFromSetPoint;
      const double noises = end ? 0.0 : Limits::kNoiseOff;
      counts = !at_zero(pv, scale) && (has_sp ? off_set_point(r, rest, share, noises, scale) : end);
    }
    for (std::size_t k = rest.from; counts && k < rest.to; ++k) limited[k] = complete(r, k) ? 1 : 0;
  }
  return limited;
}

void call_saturated(Prepared& p, const char* refusal) {
  p.gate = Gate::saturation;
  p.refusal = refusal;
  p.settle = "a record away from the limits";
}

}  // namespace

bool mostly_limited(std::size_t limited, std::size_t complete) noexcept {
  return static_cast<double>(limited) > Limits::kClampedShare * static_cast<double>(complete);
}

Prepared prepare(const numeric::LoopView& record) {
  Prepared p;
  p.gate = Gate::too_little;
  if (record.pv.size() != record.co.size()) {
    p.refusal = "PV and CO differ in length";
    return p;
  }
  const std::vector<char> limited = limited_samples(record);
  p.limited = static_cast<std::size_t>(std::count(limited.begin(), limited.end(), 1));
  for (std::size_t k = 0; k < record.pv.size(); ++k) p.complete += complete(record, k) ? 1U : 0U;
  const bool saturated =
      p.complete >= Limits::kLeastSamples && mostly_limited(p.limited, p.complete);
  if (saturated) {
    p.share_at_limit = static_cast<double>(p.limited) / static_cast<double>(p.complete);
  }
  if (saturated && stands_still(record.co)) {
    call_saturated(p, kLimitedReason);
    return p;
  }
  if (stands_still(record.co)) {
    p.refusal = "the controller output does not move: manual, or no error to correct";
    p.settle = "a record of at least an hour in automatic";
    return p;
  }
  const Part part = longest_part(record);
  if (part.size() < Limits::kLeastSamples && saturated) {
    call_saturated(p, kLimitedReason);
    return p;
  }
  if (part.size() < Limits::kLeastSamples) {
    p.settle = "a longer record in automatic, " + std::to_string(Limits::kLeastSamples) +
               " samples at least";
    p.refusal = "fewer than " + std::to_string(Limits::kLeastSamples) +
                " samples of PV and CO in a row in automatic without a long gap";
    return p;
  }
  Series pv = filled(record.pv.subspan(part.from, part.size()));
  Series co = filled(record.co.subspan(part.from, part.size()));
  Series sp;
  if (record.sp.size() == record.pv.size()) sp = filled(record.sp.subspan(part.from, part.size()));
  p.from = part.from;
  p.used = pv.size();
  if (saturated && !moves(co, Limits::kLeastMovement * (record.co_high - record.co_low))) {
    call_saturated(p, kLimitedReason);
    return p;
  }
  if (!moves(co, Limits::kLeastMovement * (record.co_high - record.co_low))) {
    p.refusal = "the controller output does not move: manual, or no error to correct";
    p.settle = "a record of at least an hour in automatic";
    return p;
  }
  if (no_flow(pv, co, sp, record)) {
    p.gate = Gate::no_flow;
    p.refusal =
        "PV stays at zero while CO travels: no flow (line shut, pump off), so the valve can't be "
        "judged";
    p.settle = "a record with flow";
    return p;
  }
  if (!moves(pv, 0.0) || frozen(pv, co)) {
    p.gate = Gate::sensor;
    p.refusal = "PV is frozen while CO moves: transmitter or its connection";
    p.settle = "look at the transmitter, then take another record";
    return p;
  }
  if (saturated) {
    call_saturated(p, kLimitedReason);
    return p;
  }
  const std::vector<char> resting = rests_at_limit(co, record.co_low, record.co_high);
  p.share_at_limit = static_cast<double>(std::count(resting.begin(), resting.end(), 1)) /
                     static_cast<double>(resting.size());
  if (p.share_at_limit > Limits::kCutFrom) {
    const Part inside = longest_free_part(resting);
    const auto least =
        std::max(Limits::kLeastSamples,
                 static_cast<std::size_t>(Limits::kFreeShare * static_cast<double>(co.size())));
    if (p.share_at_limit > Limits::kClampedShare || inside.size() < least) {
      call_saturated(p, p.share_at_limit > Limits::kClampedShare
                            ? "CO rests at its limits in more than a third of the samples"
                            : "CO reaches its limits repeatedly, and no part between is long "
                              "enough to be judged");
      return p;
    }
    const auto cut = [&inside](Series& x) {
      if (x.empty()) return;
      x.erase(x.begin() + static_cast<std::ptrdiff_t>(inside.to), x.end());
      x.erase(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(inside.from));
    };
    cut(pv);
    cut(co);
    cut(sp);
    p.from += inside.from;
    p.used = pv.size();
    if (!moves(co, Limits::kLeastMovement * (record.co_high - record.co_low)) || !moves(pv, 0.0)) {
      call_saturated(p, "CO moves only when it reaches its limits");
      return p;
    }
  }
  p.gate = Gate::open;
  p.set_point_active = follows(pv, sp);
  Series error = pv;
  if (p.set_point_active) {
    for (std::size_t k = 0; k < error.size(); ++k) error[k] -= sp[k];
  }
  p.raw_pv = pv;
  p.raw_co = co;
  p.raw_sp = sp;
  p.fast_share = noise_share(pv);
  p.held_share = held_share(pv);

  const TimeScale by_pv = find_time_scale(error);
  const TimeScale by_co = find_time_scale(co);
  const TimeScale& chosen = by_pv.score > by_co.score ? by_pv : by_co;
  double period = chosen.oscillation.period;
  if (period <= 0.0) period = static_cast<double>(pv.size()) / 4.0;
  period = std::min(period, static_cast<double>(pv.size()) / 2.0);

  p.factor = std::max<std::size_t>(1, static_cast<std::size_t>(period / Limits::kSamplesPerPeriod));
  p.pv = block_means(pv, p.factor);
  p.co = block_means(co, p.factor);
  error = block_means(error, p.factor);
  p.period = period / static_cast<double>(p.factor);
  p.period_s = period * record.period_s;
  p.cycles = static_cast<double>(p.pv.size()) / p.period;
  p.window = static_cast<std::size_t>(Limits::kWindowPeriods * p.period + 0.5);

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
