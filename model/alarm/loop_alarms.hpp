// SPDX-License-Identifier: Apache-2.0
// All alarms of one loop. What follows from another alarm is suppressed while that one is on (alarm_kind.hpp, follows),
// and shows what its own condition says when it has gone.
//
// A valve without enough air moves slowly and short of its travel; to a classifier of shapes that is
// stiction, backlash and hysteresis as well: they follow from low air.
//
// Process alarms know no windows: they come and go as their watch says (process_watch.hpp). Of several that are there
// the one whose condition began first is marked (first-out), whatever its delay: the others may be its doing.
//
// A condition that an explanation gave to another alarm counts for that one until it goes (explained()).
//
// Each call returns what changed for the operator, as transitions between the states that he sees.
//
// Errors: an action that does not fit the state changes nothing and is refused.
// What it can't do: explain alarms of one loop by those of another (a common air supply).
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

// What the verdict rule says of one valve alarm after a window that could be judged.
struct AlarmCondition {
  bool on = false;
  double severity_percent = 0.0;  // % of the CO span
};
using AlarmConditions = std::array<AlarmCondition, kValveAlarmCount>;

// Why an alarm changed.
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

// At most one for each alarm; no allocation.
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

  // Goes on from before a restart.
  void restore(AlarmKind kind, const AlarmMemory& memory) noexcept;

  // `by`: windows or routine, whichever was judged.
  AlarmTransitions judged(std::int64_t now_ms, const AlarmConditions& conditions,
                          AlarmReason by) noexcept;
  AlarmTransitions window_judged(std::int64_t now_ms, const AlarmConditions& conditions) noexcept {
    return judged(now_ms, conditions, AlarmReason::windows);
  }
  // The condition of `kind` is explained as that of `as`, which may be `kind` again: the alarm that it counted for to normal,
  // unless another condition counts for that too, and `as` unacknowledged unless it is raised already. From then on, until the
  // condition goes, it counts for `as`. Acknowledgement and shelving don't carry over.
  AlarmTransitions explained(std::int64_t now_ms, AlarmKind kind, AlarmKind as,
                             double severity_percent) noexcept;
  AlarmTransitions window_not_valid() noexcept;
  // Beside the valve alarms and the process alarms that every loop has.
  void fit(AlarmKind kind) noexcept { fitted_[index_of(kind)] = true; }
  bool fitted(AlarmKind kind) const noexcept { return fitted_[index_of(kind)]; }

  // The deviation is looked at, or rests.
  AlarmTransitions deviation_rests(bool rests) noexcept;
  // PV is not known, or is again: see loses_pv().
  AlarmTransitions pv_lost(bool lost) noexcept;
  // Conditions of process alarms that came or went in one cycle.
  AlarmTransitions process_changed(std::int64_t now_ms,
                                   std::span<const ProcessChange> changes) noexcept;
  AlarmTransitions pass_time(std::int64_t now_ms) noexcept;

  struct ActionResult {
    bool accepted = false;
    AlarmTransitions transitions;
  };
  // `until_ms` is for shelve alone.
  ActionResult act(AlarmKind kind, AlarmAction action, std::int64_t now_ms,
                   std::int64_t until_ms = 0) noexcept;

  const Alarm& alarm(AlarmKind kind) const noexcept { return alarms_[index_of(kind)]; }
  // The first alarm that is on and that `kind` follows from; nothing: it stands for itself.
  std::optional<AlarmKind> cause_of(AlarmKind kind) const noexcept;
  // Its condition began before those of the other process alarms that are there. Of one alone nothing is said.
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
  std::array<std::uint64_t, kAlarmKindCount> began_{};  // periods; 0: not known
  bool deviation_rests_ = false;
  bool pv_lost_ = false;
  // What a valve alarm's condition that is on counts for; itself unless it was explained.
  struct CountsFor {
    AlarmKind kind = AlarmKind::stiction;
    double severity_percent = 0.0;
  };
  std::array<CountsFor, kValveAlarmCount> counts_for_{};
  std::array<bool, kValveAlarmCount> on_{};  // conditions as they were judged last
};

}  // namespace loopwarden::alarm
