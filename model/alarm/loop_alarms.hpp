// SPDX-License-Identifier: Apache-2.0
// All alarms of one loop. An active alarm suppresses the alarms that follow from it
// (alarm_kind.hpp, follows). When it clears, each of them shows its own condition again.
//
// A valve without enough air moves slowly and doesn't reach its travel. To a classifier of shapes
// this is also stiction, backlash and hysteresis, so these follow from low air.
//
// Process alarms don't depend on windows: process_watch.hpp raises and clears them. If several are
// active, the one whose condition began first is marked (first-out), whatever its delay, because it
// may have caused the others.
//
// The loss of a connection that the loop shares with others is an alarm of the box. While it lasts,
// the alarms that follow from it are suppressed here.
//
// A condition that an explanation assigned to another alarm counts for that alarm until it clears
// (explained()).
//
// Each call returns the changes for the operator, as transitions between the visible states.
//
// Errors: an action that doesn't fit the state is refused and leaves the state as it is.
// Limits: it can't explain alarms of one loop by those of another (a common air supply).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "model/alarm/alarm.hpp"
#include "model/alarm/alarm_kind.hpp"
#include "model/alarm/process_watch.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

// The verdict rule's result for one valve alarm, after a window that could be judged.
struct AlarmCondition {
  bool on = false;
  double severity_percent = 0.0;  // % of the CO span
};
using AlarmConditions = std::array<AlarmCondition, kValveAlarmCount>;

// The reason for a change of an alarm.
enum class AlarmReason : std::uint8_t { windows, routine, by_operator, twin, explained, process };
constexpr const char* to_text(AlarmReason reason) noexcept {
  return numeric::enum_name<AlarmReason::process>(
      reason, {"windows", "routine", "operator", "twin", "explained", "process"});
}

struct AlarmTransition {
  AlarmKind kind = AlarmKind::stiction;
  AlarmState from = AlarmState::normal;
  AlarmState to = AlarmState::normal;
  double severity_percent = 0.0;
  AlarmReason reason = AlarmReason::windows;
};

// A list of transitions, at most one per alarm; no allocation.
class AlarmTransitions {
 public:
  void add(const AlarmTransition& transition) noexcept { items_[count_++] = transition; }
  std::span<const AlarmTransition> view() const noexcept { return {items_.data(), count_}; }
  bool empty() const noexcept { return count_ == 0; }

 private:
  std::array<AlarmTransition, kAlarmKindCount> items_;
  std::size_t count_ = 0;
};

class LoopAlarms {
 public:
  explicit LoopAlarms(const AlarmSettings& settings) noexcept;

  // Continues from the state before a restart.
  void restore(AlarmKind kind, const AlarmMemory& memory) noexcept;

  // Passes on the conditions of a judgement. `by`: windows or routine.
  AlarmTransitions judged(std::int64_t now_ms, const AlarmConditions& conditions,
                          AlarmReason by) noexcept;
  AlarmTransitions window_judged(std::int64_t now_ms, const AlarmConditions& conditions) noexcept {
    return judged(now_ms, conditions, AlarmReason::windows);
  }
  // An explanation assigns the condition of `kind` to `as`, which may be `kind` again. The alarm
  // for which it counted returns to normal, unless another condition counts for that alarm too.
  // `as` becomes unacknowledged unless it is active already. The condition counts for `as` until it
  // clears. Acknowledgement and shelving don't carry over.
  AlarmTransitions explained(std::int64_t now_ms, AlarmKind kind, AlarmKind as,
                             double severity_percent) noexcept;
  AlarmTransitions window_not_valid() noexcept;
  // Adds `kind` to the valve alarms and the process alarms that every loop has.
  void fit(AlarmKind kind) noexcept { fitted_[index_of(kind)] = true; }
  bool fitted(AlarmKind kind) const noexcept { return fitted_[index_of(kind)]; }

  // Stops or resumes the check of the deviation.
  AlarmTransitions deviation_rests(bool rests) noexcept;
  // Reports whether PV is unknown at present: see loses_pv().
  AlarmTransitions pv_lost(bool lost) noexcept;
  // Reports whether an alarm of the box stands for the loss of the loop's connection.
  AlarmTransitions behind_outage(bool behind) noexcept;
  // The connection is back, but `kind` is still present: it follows from no other alarm until the
  // next call of behind_outage().
  AlarmTransitions still_there(AlarmKind kind) noexcept;
  // Returns whether `kind` follows from the lost connection.
  bool follows_outage(AlarmKind kind) const noexcept;
  // Passes on the conditions of process alarms that were raised or cleared in one cycle.
  AlarmTransitions process_changed(std::int64_t now_ms,
                                   std::span<const ProcessChange> changes) noexcept;
  AlarmTransitions pass_time(std::int64_t now_ms) noexcept;

  struct ActionResult {
    bool accepted = false;
    AlarmTransitions transitions;
  };
  // Only shelve uses `until_ms`.
  ActionResult act(AlarmKind kind, AlarmAction action, std::int64_t now_ms,
                   std::int64_t until_ms = 0) noexcept;

  const Alarm& alarm(AlarmKind kind) const noexcept { return alarms_[index_of(kind)]; }
  // Returns the first active alarm from which `kind` follows; empty if it follows from no other.
  std::optional<AlarmKind> cause_of(AlarmKind kind) const noexcept;
  // Returns whether its condition began before those of the other active process alarms. False for
  // a single alarm.
  bool first_out(AlarmKind kind) const noexcept;
  bool any_shelved() const noexcept;
  bool any_suppressed() const noexcept;

 private:
  using States = std::array<AlarmState, kAlarmKindCount>;
  States states() const noexcept;
  void find_root() noexcept;
  bool began_before(AlarmKind one, AlarmKind other) const noexcept;
  AlarmTransitions since(const States& before, AlarmReason reason) const noexcept;
  template <class Change>
  AlarmTransitions after(AlarmReason reason, Change change) noexcept;

  std::array<Alarm, kAlarmKindCount> alarms_;
  std::array<bool, kAlarmKindCount> fitted_{};
  std::array<std::uint64_t, kAlarmKindCount> began_{};  // periods; 0: unknown
  bool deviation_rests_ = false;
  bool pv_lost_ = false;
  bool behind_outage_ = false;
  std::array<bool, kAlarmKindCount> own_{};  // still present after the outage
  // The alarm for which an active condition of a valve alarm counts: itself, unless it was
  // explained.
  struct CountsFor {
    AlarmKind kind = AlarmKind::stiction;
    double severity_percent = 0.0;
  };
  std::array<CountsFor, kValveAlarmCount> counts_for_{};
  std::array<bool, kValveAlarmCount> on_{};  // conditions of the newest judgement
};

}  // namespace loopwarden::alarm
