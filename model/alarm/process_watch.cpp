// SPDX-License-Identifier: Apache-2.0
#include "model/alarm/process_watch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/alarm/limits.hpp"

namespace loopwarden::alarm {

using control::Fault;
using control::Mode;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Returns whole periods. A rounding error above a whole number is dropped.
std::uint64_t periods_of(double seconds, double sample_time_s) noexcept {
  constexpr double kRounding = 1e-9;
  if (!(sample_time_s > 0.0)) return 1;
  return static_cast<std::uint64_t>(std::ceil(std::max(seconds / sample_time_s - kRounding, 0.0)));
}

bool is_normal(Mode mode, NormalMode normal) noexcept {
  switch (normal) {
    case NormalMode::automatic: return mode == Mode::automatic;
    case NormalMode::manual: return mode == Mode::manual;
    case NormalMode::any: break;
  }
  return true;
}

// Returns whether a test of the loop causes the condition.
bool is_of_test(AlarmKind kind) noexcept {
  return kind == AlarmKind::output_lost || kind == AlarmKind::output_unknown ||
         kind == AlarmKind::not_normal_mode || kind == AlarmKind::deviation;
}

}  // namespace

ProcessWatch::ProcessWatch(double sample_time_s, const ProcessSettings& settings) noexcept
    : sample_time_s_(sample_time_s),
      settings_(settings),
      limits_(sample_time_s, settings.limits),
      quiet_periods_(periods_of(Limits::kOffDelay_s, sample_time_s)),
      first_values_periods_(periods_of(Limits::kFirstValues_s, sample_time_s)) {}

void ProcessWatch::restore(AlarmKind kind, bool on) noexcept {
  Delayed& condition = at(kind);
  condition.on = condition.there = on;
  condition.flaps = on ? 1 : 0;
  if (kind == AlarmKind::not_normal_mode) ever_ran_ = ever_ran_ || on;
}

ProcessChanges ProcessWatch::add(const ProcessCycle& cycle) noexcept {
  ever_arrived_ = ever_arrived_ || cycle.output_arrives;
  ever_ran_ =
      ever_ran_ || (!cycle.out_of_service &&
                    (cycle.requested_mode == Mode::automatic || cycle.mode == Mode::automatic ||
                     (cycle.mode == Mode::fallback && cycle.fault != Fault::starting)));
  limits_.add(cycle.period_index, cycle.sp, cycle.pv_bad || cycle.pv_frozen ? kNone : cycle.pv,
              cycle.mode == Mode::automatic);
  ProcessChanges changes;
  for (const AlarmKind kind : kProcessAlarms) {
    const ProcessRule& rule = settings_.at(kind);
    if (!rule.fitted) continue;
    Delayed& condition = at(kind);
    const std::optional<bool> now = found(kind, cycle);
    if (now) count(condition, *now, cycle.period_index);
    if (!now || *now == condition.on) {
      condition.other_since.reset();
      continue;
    }
    if (!condition.other_since) condition.other_since = cycle.period_index;
    const bool follows_cause = condition.on && suppressed(kind);
    if (!follows_cause && !is_due(condition, rule, cycle.period_index)) continue;
    condition.on = *now;
    condition.other_since.reset();
    changes.add({kind, *now, condition.began});
  }
  return changes;
}

void ProcessWatch::count(Delayed& condition, bool there, std::uint64_t period) const noexcept {
  if (there == condition.there) return;
  condition.there = there;
  if (!there) {
    condition.gone_at = period;
    return;
  }
  if (!condition.on && period - condition.gone_at > quiet_periods_) condition.flaps = 0;
  if (condition.flaps == 0) condition.began = period;
  if (condition.flaps < std::numeric_limits<std::uint32_t>::max()) ++condition.flaps;
}

bool ProcessWatch::suppressed(AlarmKind kind) const noexcept {
  const bool lost = pv_lost();
  return std::any_of(kProcessAlarms.begin(), kProcessAlarms.end(), [&](AlarmKind cause) {
    return follows(kind, cause) && at(cause).on && (lost || !is_of_pv(kind) || !loses_pv(cause));
  });
}

bool ProcessWatch::is_due(const Delayed& condition, const ProcessRule& rule,
                          std::uint64_t period) const noexcept {
  const std::uint64_t since = period - *condition.other_since;
  if (condition.on) {
    const std::uint64_t delay = periods_of(rule.off_delay_s, sample_time_s_);
    return since >= (condition.flaps > 1 ? std::max(delay, quiet_periods_) : delay);
  }
  return condition.flaps >= Limits::kFlaps || since >= periods_of(rule.on_delay_s, sample_time_s_);
}

std::optional<bool> ProcessWatch::found(AlarmKind kind, const ProcessCycle& cycle) const noexcept {
  if (cycle.out_of_service && is_of_test(kind)) return std::nullopt;
  if (cycle.pv_awaited && cycle.period_index < first_values_periods_) return std::nullopt;
  switch (kind) {
    case AlarmKind::bad_pv:
      return cycle.pv_bad || cycle.pv_frozen || (!cycle.pv_good && cycle.fault == Fault::bad_pv);
    case AlarmKind::output_lost: return output_lost(cycle);
    case AlarmKind::output_unknown:
      if (cycle.fault == Fault::output_unknown) return true;
      return cycle.fault == Fault::none ? std::optional(false) : std::nullopt;
    case AlarmKind::not_normal_mode: return not_normal_mode(cycle);
    case AlarmKind::enable_open:
      return cycle.fault == Fault::stop ? std::nullopt
                                        : std::optional(cycle.fault == Fault::enable_open);
    case AlarmKind::source_lost: return cycle.pv_silent;
    default: break;
  }
  return limits_.beyond(kind, at(kind).there);
}

std::optional<bool> ProcessWatch::not_normal_mode(const ProcessCycle& cycle) const noexcept {
  if (cycle.mode == Mode::fallback && cycle.pv_bad) return std::nullopt;
  if (cycle.mode == Mode::manual && !ever_ran_) return false;
  return !is_normal(cycle.mode, settings_.normal_mode);
}

std::optional<bool> ProcessWatch::output_lost(const ProcessCycle& cycle) const noexcept {
  if (cycle.output_arrives) return false;
  if (ever_arrived_ || cycle.fault == Fault::output_lost) return true;
  if (cycle.fault != Fault::starting) return false;
  // A start waits for PV and device. If it has the PV that it needs, it waits for the device.
  const bool has_pv = cycle.pv_good || cycle.requested_mode == Mode::manual;
  return has_pv ? std::optional(true) : std::nullopt;
}

}  // namespace loopwarden::alarm
