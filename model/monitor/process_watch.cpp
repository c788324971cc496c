// SPDX-License-Identifier: Apache-2.0
#include "model/monitor/process_watch.hpp"

#include <cmath>

namespace loopwarden::monitor {

using control::Fault;
using control::Mode;

namespace {

// Whole periods; what is a rounding error above a whole number is that number.
std::uint64_t periods_of_delay(double sample_time_s) noexcept {
  constexpr double kRounding = 1e-9;
  if (!(sample_time_s > 0.0)) return 1;
  return static_cast<std::uint64_t>(std::ceil(kProcessDelay_s / sample_time_s - kRounding));
}

bool is_normal(Mode mode, NormalMode normal) noexcept {
  switch (normal) {
    case NormalMode::automatic: return mode == Mode::automatic;
    case NormalMode::manual: return mode == Mode::manual;
    case NormalMode::any: break;
  }
  return true;
}

}  // namespace

ProcessWatch::ProcessWatch(double sample_time_s, NormalMode normal_mode) noexcept
    : normal_mode_(normal_mode), delay_periods_(periods_of_delay(sample_time_s)) {}

ProcessChanges ProcessWatch::add(const ProcessCycle& cycle) noexcept {
  ever_arrived_ = ever_arrived_ || cycle.output_arrives;
  ProcessChanges changes;
  for (const AlarmKind kind : kProcessAlarms) {
    Delayed& condition = at(kind);
    const std::optional<bool> now = found(kind, cycle);
    if (!now || *now == condition.on) {
      condition.other_since.reset();
      continue;
    }
    if (!condition.other_since) condition.other_since = cycle.period_index;
    if (cycle.period_index - *condition.other_since < delay_periods_) continue;
    condition = {*now, std::nullopt};
    changes.add({kind, *now});
  }
  return changes;
}

std::optional<bool> ProcessWatch::found(AlarmKind kind, const ProcessCycle& cycle) const noexcept {
  switch (kind) {
    case AlarmKind::bad_pv: return cycle.pv_bad || (!cycle.pv_good && cycle.fault == Fault::bad_pv);
    case AlarmKind::output_lost: return output_lost(cycle);
    case AlarmKind::output_unknown:
      if (cycle.fault == Fault::output_unknown) return true;
      return cycle.fault == Fault::none ? std::optional(false) : std::nullopt;
    default: break;
  }
  return !is_normal(cycle.mode, normal_mode_);
}

std::optional<bool> ProcessWatch::output_lost(const ProcessCycle& cycle) const noexcept {
  if (cycle.output_arrives) return false;
  if (ever_arrived_ || cycle.fault == Fault::output_lost) return true;
  if (cycle.fault != Fault::starting) return false;
  // A start waits for PV and device; with the PV that it needs, it is the device.
  const bool has_pv = cycle.pv_good || cycle.requested_mode == Mode::manual;
  return has_pv ? std::optional(true) : std::nullopt;
}

}  // namespace loopwarden::monitor
