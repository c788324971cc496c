// SPDX-License-Identifier: Apache-2.0
// The states of one alarm and its handling by the operator, after ISA-18.2.
//
//   state                    condition  seen by the operator
//   normal                   off        -
//   unacknowledged           on         no
//   acknowledged             on         yes
//   returned_unacknowledged  off        no
//   latched_unacknowledged   off        no         latching alarms stay until they are reset
//   latched_acknowledged     off        yes
//   shelved                  any        set aside by the operator for a limited time
//   suppressed               any        not raised, by design
//
// The verdict rule reports the condition of a valve alarm once per window that could be judged.
// process_watch.hpp reports the condition of a process alarm. The rules differ from the standard
// in three points, for the sake of the operator:
//
//  - A window that can't be judged doesn't prove a repair. An active alarm stays active. An
//    inactive alarm is `suppressed`, because it could not be raised.
//  - An alarm that is the consequence of another alarm is suppressed, whatever its condition. Later
//    it has its earlier state again, acknowledged if it had been acknowledged.
//  - An alarm that leaves the shelf is unacknowledged if its condition is on, as a reminder. If its
//    condition is off, it is normal: the operator who shelved it doesn't need its history.
//
// The caller passes the time in ms of a clock that continues after a restart (UTC). A clock that
// was set back can't keep an alarm on the shelf for longer than the limit.
//
// Errors: an action that doesn't fit the state is refused (false) and leaves the state as it is.
// Limits: no out-of-service state (the standard's ninth), no on and off delays. The windows of
// the verdict rule replace the delays, and process_watch.hpp has its own.
//
// Source: ANSI/ISA-18.2-2016 (IEC 62682), alarm state transition diagram.
#pragma once

#include <cstdint>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

// The register map uses these numbers. They never change.
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
  std::int64_t shelve_limit_ms = 8LL * 3600 * 1000;  // longest duration of the shelving

  friend bool operator==(const AlarmSettings&, const AlarmSettings&) = default;
};

// The part of an alarm that must survive a restart.
struct AlarmMemory {
  AlarmState raised =
      AlarmState::normal;             // one of the first six: the state under shelf and suppression
  std::int64_t shelved_until_ms = 0;  // 0: not shelved
  std::int64_t raised_ms = 0;         // when the condition was last raised; 0: never
  std::int64_t changed_ms = 0;        // when `raised` or the shelf last changed
  std::uint32_t times_raised = 0;
  double severity_percent = 0.0;        // % of the CO span, newest of the condition
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
  // Continues from `memory`. A memory with impossible values gives a normal alarm.
  Alarm(const AlarmSettings& settings, const AlarmMemory& memory) noexcept;

  // --- findings of the monitor ---
  void condition_on(std::int64_t now_ms, double severity_percent) noexcept;
  void condition_off(std::int64_t now_ms) noexcept;
  void window_not_valid() noexcept { window_valid_ = false; }
  // For an alarm that needs no window.
  void always_valid() noexcept { window_valid_ = true; }
  void set_consequence(bool of_another) noexcept { consequence_ = of_another; }
  // Returns the alarm to normal, whatever its state: the condition belongs to another alarm.
  void take_back(std::int64_t now_ms) noexcept {
    memory_.shelved_until_ms = 0;
    change(AlarmState::normal, now_ms);
  }

  // --- actions of the operator ---
  bool acknowledge(std::int64_t now_ms) noexcept;
  bool reset(std::int64_t now_ms) noexcept;  // of a latched alarm
  // Refused if `until_ms` is not after `now_ms`, or is later than the limit allows.
  bool shelve(std::int64_t now_ms, std::int64_t until_ms) noexcept;
  bool unshelve(std::int64_t now_ms) noexcept;
  // Carries out `action`. Only shelve uses `until_ms`.
  bool act(AlarmAction action, std::int64_t now_ms, std::int64_t until_ms) noexcept;

  // Ends a shelving whose time is over. Returns true if it did.
  bool pass_time(std::int64_t now_ms) noexcept;

  AlarmState state() const noexcept;
  bool active() const noexcept;  // the condition is on, in any state
  bool unacknowledged()
      const noexcept;  // waits for the operator; neither shelved nor a consequence
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
  // False until the first window is judged: no alarm can be raised before.
  bool window_valid_ = false;
  bool consequence_ = false;
};

}  // namespace loopwarden::alarm
