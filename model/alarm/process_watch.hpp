// SPDX-License-Identifier: Apache-2.0
// The conditions of a loop's process alarms, from its cycles. They show whether the loop does its
// work.
//
//   bad_pv           PV is bad or frozen, in every mode and also during the start of the loop; or
//                    it is uncertain and that is the loop's fault
//   output_lost      commands don't reach the device. Before the first command has arrived, the
//                    alarm needs a loop that has its PV and still can't start: a loop without a
//                    command to write has lost no output
//   output_unknown   the position of the output is unknown; a graver fault hides this condition
//   not_normal_mode  the mode in force differs from the loop's normal mode; fallback is never
//                    normal. Manual counts after the loop has been in automatic, or after a fault
//                    ended its mode: a loop that is not yet in service is not out of its normal
//                    mode. Fallback while PV is bad gives no information, because bad_pv or the
//                    lost connection is the alarm: the delay starts when PV is back
//   enable_open      the enable contact is open
//   source_lost      the source of PV is silent, for loops that another controller runs
//   other alarms     PV is beyond a limit (limit_watch.hpp)
//
// A loop that another controller runs gives no information before its first PV, for at most
// kFirstValues_s after the start: feeders need this time to connect.
//
// A condition is raised after it was present without a break for its on-delay. It clears after it
// was absent for its off-delay. A cycle without information leaves the condition as it is and
// restarts the delay. Time is the loop's own, counted in its periods; between two cycles the first
// one is valid.
//
// A consequence of an active alarm (alarm_kind.hpp) clears without its off-delay, so it doesn't
// outlast its cause.
//
// A flapping condition raises one alarm with a count. `flaps` counts how often the condition was
// raised again within a minute or, with a longer off-delay, while the alarm was on. From the second
// time on, the alarm clears only after such a minute or its longer off-delay. The first time it
// does so too, unless the off-delay is shorter. At the fifth time the alarm is raised even if no
// single time outlasts the on-delay.
//
// While a loop is out of service for a test, output_lost, output_unknown, not_normal_mode and
// deviation keep their state, because the test causes them. Their delays start again when the test
// has ended. Alarms of PV and of the enable contact continue.
//
// Stepped once per cycle. No clock, no allocation.
//
// No errors.
// Limits: it can't report why the output is lost, because a record's row doesn't contain the
// reason.
//
// Source: delays, and chattering at three times per minute, as in ANSI/ISA-18.2-2016 (basic alarm
// design) and EEMUA 191 (2013), chapter 8. The on-delay of 10 s is our own choice: longer than a
// reconnection or a late reply, shorter than the time that a process tolerates.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "model/alarm/limits.hpp"
#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"
#include "model/alarm/alarm_kind.hpp"
#include "model/alarm/limit_watch.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

enum class NormalMode : std::uint8_t { automatic, manual, any };

constexpr const char* to_text(NormalMode mode) noexcept {
  return numeric::enum_name<NormalMode::any>(mode, {"automatic", "manual", "any"});
}

struct ProcessRule {
  bool fitted = false;
  double on_delay_s = Limits::kProcessDelay_s;  // s, >= 0
  double off_delay_s = Limits::kOffDelay_s;     // s, >= 0

  friend bool operator==(const ProcessRule&, const ProcessRule&) = default;
};

// Returns the default rules, which every loop has.
constexpr std::array<ProcessRule, kProcessAlarmCount> usual_rules() noexcept {
  std::array<ProcessRule, kProcessAlarmCount> rules{};
  for (const AlarmKind kind : {AlarmKind::bad_pv, AlarmKind::output_lost, AlarmKind::output_unknown,
                               AlarmKind::not_normal_mode}) {
    rules[index_of(kind) - kValveAlarmCount].fitted = true;
  }
  return rules;
}

struct ProcessSettings {
  NormalMode normal_mode = NormalMode::automatic;
  std::array<ProcessRule, kProcessAlarmCount> rules = usual_rules();  // as kProcessAlarms
  LimitSettings limits;

  ProcessRule& at(AlarmKind kind) noexcept { return rules[index_of(kind) - kValveAlarmCount]; }
  const ProcessRule& at(AlarmKind kind) const noexcept {
    return rules[index_of(kind) - kValveAlarmCount];
  }
  friend bool operator==(const ProcessSettings&, const ProcessSettings&) = default;
};

struct ProcessCycle {
  std::uint64_t period_index = 0;
  double sp = std::numeric_limits<double>::quiet_NaN();  // PV units, working; NaN: unknown
  double pv = std::numeric_limits<double>::quiet_NaN();  // PV units; NaN: bad
  bool pv_good = false;
  bool pv_bad = false;          // pv_good and pv_bad both false: uncertain
  bool pv_frozen = false;       // does not change although CO moves
  bool pv_silent = false;       // bad, because its source is silent
  bool pv_awaited = false;      // of a loop that another controller runs: never received
  bool output_arrives = false;  // the device has confirmed the newest command
  bool out_of_service = false;  // the loop is under test
  control::Fault fault = control::Fault::none;
  control::Mode mode = control::Mode::manual;            // in force
  control::Mode requested_mode = control::Mode::manual;  // by the operator
};

struct ProcessChange {
  AlarmKind kind = AlarmKind::bad_pv;
  bool on = false;
  std::uint64_t began = 0;  // period in which the condition first appeared; 0: unknown

  friend bool operator==(const ProcessChange&, const ProcessChange&) = default;
};

class ProcessChanges {
 public:
  void add(const ProcessChange& change) noexcept { items_[count_++] = change; }
  std::span<const ProcessChange> view() const noexcept { return {items_.data(), count_}; }

 private:
  std::array<ProcessChange, kProcessAlarmCount> items_;
  std::size_t count_ = 0;
};

class ProcessWatch {
 public:
  ProcessWatch(double sample_time_s, const ProcessSettings& settings) noexcept;

  // Restores a condition from before a restart.
  void restore(AlarmKind kind, bool on) noexcept;

  ProcessChanges add(const ProcessCycle& cycle) noexcept;

  // Returns whether PV is bad or its source is lost, by the newest cycle.
  bool pv_lost() const noexcept {
    return at(AlarmKind::bad_pv).there || at(AlarmKind::source_lost).there;
  }
  // Returns whether the deviation is suppressed at present.
  bool deviation_rests() const noexcept { return limits_.rests(); }
  // Returns whether the newest cycle with information shows the condition.
  bool there(AlarmKind kind) const noexcept { return at(kind).there; }
  // Returns how often the condition was raised again within a minute, or while the alarm was on.
  std::uint32_t flaps(AlarmKind kind) const noexcept { return at(kind).flaps; }

 private:
  struct Delayed {
    bool on = false;                           // condition of the alarm
    bool there = false;                        // by the newest cycle with information
    std::optional<std::uint64_t> other_since;  // period since which cycles show the opposite
    std::uint32_t flaps = 0;
    std::uint64_t began = 0;    // period in which the first of them began
    std::uint64_t gone_at = 0;  // period in which it last cleared
  };
  Delayed& at(AlarmKind kind) noexcept { return conditions_[index_of(kind) - kValveAlarmCount]; }
  const Delayed& at(AlarmKind kind) const noexcept {
    return conditions_[index_of(kind) - kValveAlarmCount];
  }
  // Returns whether the cycle shows the condition; empty if it has no information.
  std::optional<bool> found(AlarmKind kind, const ProcessCycle& cycle) const noexcept;
  std::optional<bool> output_lost(const ProcessCycle& cycle) const noexcept;
  std::optional<bool> not_normal_mode(const ProcessCycle& cycle) const noexcept;
  void count(Delayed& condition, bool there, std::uint64_t period) const noexcept;
  // Returns whether a cause of `kind` is on.
  bool suppressed(AlarmKind kind) const noexcept;
  bool is_due(const Delayed& condition, const ProcessRule& rule,
              std::uint64_t period) const noexcept;

  double sample_time_s_;
  ProcessSettings settings_;
  LimitWatch limits_;
  std::uint64_t quiet_periods_;
  std::uint64_t first_values_periods_;
  bool ever_arrived_ = false;  // a command has arrived since the start
  bool ever_ran_ = false;      // the loop was in automatic, or in a fault
  std::array<Delayed, kProcessAlarmCount> conditions_{};
};

}  // namespace loopwarden::alarm
