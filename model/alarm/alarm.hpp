// SPDX-License-Identifier: Apache-2.0
// One alarm and its life with the operator: the states of ISA-18.2.
//
//   state                    condition  seen by the operator
//   normal                   off        -
//   unacknowledged           on         no
//   acknowledged             on         yes
//   returned_unacknowledged  off        no
//   latched_unacknowledged   off        no         latching alarms stay until they are reset
//   latched_acknowledged     off        yes
//   shelved                  any        put aside by the operator for a limited time
//   suppressed               any        not raised, by design; the reason says why
//
// The condition comes from the verdict rule, once for each window that could be judged; of a process alarm from
// process_watch.hpp. Where the rule differs from a plain reading of the standard, it is so that an operator can live with it:
//
//  - A window that can't be judged is no evidence of repair: an alarm that was raised stays raised; only
//    an alarm that is off shows `suppressed` then, because it could not come.
//  - An alarm that is the consequence of another one is suppressed whatever its condition, and comes back as it was,
//    acknowledged if it had been acknowledged.
//  - What comes off the shelf with its condition on is unacknowledged, as a reminder; with its condition
//    off it is normal: the operator who put it aside does not want to hear that it came and went.
//
// Time is the caller's, ms on a clock that means the same after a restart (UTC). A clock that was set
// back can't keep an alarm on the shelf for longer than the limit.
//
// Errors: an action that does not fit the state is refused (false) and changes nothing.
// What it can't do: out-of-service (the standard's ninth state); on and off delays, which the verdict
// rule's windows stand for, and process_watch.hpp has.
//
// Source: ANSI/ISA-18.2-2016 (IEC 62682), alarm state transition diagram.
#pragma once

#include <cstdint>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

// The numbers are those of the register map and never change.
enum class AlarmState : std::uint8_t {
  normal = 0,
  unacknowledged = 1,
  acknowledged = 2,
  returned_unacknowledged = 3,
  latched_unacknowledged = 4,
  latched_acknowledged = 5,
  shelved = 6,
  suppressed = 7
};
inline constexpr std::uint8_t kAlarmStates = 8;

constexpr const char* to_text(AlarmState state) noexcept {
  return numeric::enum_name<AlarmState::suppressed>(
      state, {"normal", "unacknowledged", "acknowledged", "returned_unacknowledged",
              "latched_unacknowledged", "latched_acknowledged", "shelved", "suppressed"});
}

struct AlarmSettings {
  bool latching = false;
  std::int64_t shelve_limit_ms = 8LL * 3600 * 1000;  // the longest that one shelving may last

  friend bool operator==(const AlarmSettings&, const AlarmSettings&) = default;
};

// All of an alarm that must survive a restart.
struct AlarmMemory {
  AlarmState raised =
      AlarmState::normal;             // one of the first six: what is under shelf and suppression
  std::int64_t shelved_until_ms = 0;  // 0: not shelved
  std::int64_t raised_ms = 0;         // when the condition last came; 0: never
  std::int64_t changed_ms = 0;        // when `raised` or the shelf last changed
  std::uint32_t times_raised = 0;
  double severity_percent = 0.0;        // % of the CO span, as the condition last had it
  double worst_severity_percent = 0.0;  // since it was raised

  friend bool operator==(const AlarmMemory&, const AlarmMemory&) = default;
};

enum class AlarmAction : std::uint8_t { acknowledge, reset, shelve, unshelve };
constexpr const char* to_text(AlarmAction action) noexcept {
  return numeric::enum_name<AlarmAction::unshelve>(action,
                                                   {"acknowledge", "reset", "shelve", "unshelve"});
}

class Alarm {
 public:
  Alarm() = default;
  explicit Alarm(const AlarmSettings& settings) noexcept : settings_(settings) {}
  // Goes on from what was remembered; impossible values become a normal alarm.
  Alarm(const AlarmSettings& settings, const AlarmMemory& memory) noexcept;

  // --- what the monitor finds ---
  void condition_on(std::int64_t now_ms, double severity_percent) noexcept;
  void condition_off(std::int64_t now_ms) noexcept;
  void window_not_valid() noexcept { window_valid_ = false; }
  // It needs no window.
  void always_valid() noexcept { window_valid_ = true; }
  void set_consequence(bool of_another) noexcept { consequence_ = of_another; }
  // It was another alarm's: normal, whatever the operator has done with it.
  void take_back(std::int64_t now_ms) noexcept {
    memory_.shelved_until_ms = 0;
    change(AlarmState::normal, now_ms);
  }

  // --- what the operator does ---
  bool acknowledge(std::int64_t now_ms) noexcept;
  bool reset(std::int64_t now_ms) noexcept;  // of a latched alarm
  // Refused where `until_ms` is not after now, or further than the limit.
  bool shelve(std::int64_t now_ms, std::int64_t until_ms) noexcept;
  bool unshelve(std::int64_t now_ms) noexcept;
  // One of these; `until_ms` is for shelve alone.
  bool act(AlarmAction action, std::int64_t now_ms, std::int64_t until_ms) noexcept;

  // Lets time pass: a shelving ends. True if it did.
  bool pass_time(std::int64_t now_ms) noexcept;

  AlarmState state() const noexcept;
  bool active() const noexcept;  // the condition is on, whatever the operator has done with it
  bool unacknowledged()
      const noexcept;  // waits for the operator, and is neither shelved nor a consequence
  bool shelved() const noexcept { return memory_.shelved_until_ms != 0; }
  bool window_valid() const noexcept { return window_valid_; }
  bool is_consequence() const noexcept { return consequence_; }
  const AlarmMemory& memory() const noexcept { return memory_; }
  const AlarmSettings& settings() const noexcept { return settings_; }

 private:
  void change(AlarmState raised, std::int64_t now_ms) noexcept;
  void take_off_shelf(std::int64_t now_ms) noexcept;

  AlarmSettings settings_;
  AlarmMemory memory_;
  // Nothing has been judged yet: no alarm can come before the first window.
  bool window_valid_ = false;
  bool consequence_ = false;
};

}  // namespace loopwarden::alarm
