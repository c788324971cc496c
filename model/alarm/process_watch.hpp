// SPDX-License-Identifier: Apache-2.0
// Whether a loop does its work: the conditions of its process alarms, from its cycles.
//
//   bad_pv           PV is bad or frozen, in every mode, while the loop starts too; or it is
//                    uncertain and that is the loop's fault
//   output_lost      commands don't reach the device. Before the first one has, only a loop that has its PV and still can't
//                    start tells; a loop that has nothing to write yet has lost nothing
//   output_unknown   where the output stands is not known; a graver fault hides it
//   not_normal_mode  the mode in force is another one than the loop's normal mode: fallback is never normal. Manual counts
//                    once the loop has been in automatic, or a fault has ended its mode: one that is not yet in service is
//                    not out of its mode
//   enable_open      the enable contact is open
//   source_lost      what brings PV is silent: of loops that another controller has
//   the rest         PV is where it should not be (limit_watch.hpp)
//
// A condition comes once it has been there for its on-delay without a break, and goes once it has been gone for its
// off-delay. What a cycle can't tell changes nothing and starts the delay anew. Time is the loop's own, counted in its
// periods; between two cycles the first one holds.
//
// What follows from an alarm that is on (alarm_kind.hpp) goes without its off-delay: so it does not outlast its cause.
//
// What flaps is one alarm with a count: `flaps` counts how often the condition has come without a minute between, or, with
// an off-delay that is longer, while the alarm was on. From the second time on the alarm goes only after such a minute, or
// its longer off-delay, and so it does the first time unless the off-delay is shorter; what comes the fifth time raises
// its alarm although no single time outlasts the on-delay.
//
// While a loop is out of service for a test, output_lost, output_unknown, not_normal_mode and
// deviation change nothing: the test causes them. Their delays start again when the test has ended.
// Alarms of PV and of the enable contact go on.
//
// Stepped once a cycle. No clock, no allocation.
//
// Errors: none.
// What it can't do: say why the output is lost; a record's row does not hold it.
//
// Source: delays, and three times a minute as chattering, as in ANSI/ISA-18.2-2016 (basic alarm design) and EEMUA 191
// (2013), chapter 8; the 10 s to come are ours: longer than a reconnection or a late reply, shorter than what a process
// bears.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"
#include "model/alarm/alarm_kind.hpp"
#include "model/alarm/limit_watch.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::alarm {

// To come, where a loop's file says nothing else.
inline constexpr double kProcessDelay_s = 10.0;
inline constexpr double kDeviationDelay_s = 60.0;
// Without the condition, and it flaps no longer; to go, where a loop's file says nothing else.
inline constexpr double kQuiet_s = 60.0;
inline constexpr std::uint32_t kFlaps = 5;  // raise the alarm

enum class NormalMode : std::uint8_t { automatic, manual, any };

constexpr const char* to_text(NormalMode mode) noexcept {
  return numeric::enum_name<NormalMode::any>(mode, {"automatic", "manual", "any"});
}

struct ProcessRule {
  bool fitted = false;
  double on_delay_s = kProcessDelay_s;  // s, >= 0
  double off_delay_s = kQuiet_s;        // s, >= 0

  friend bool operator==(const ProcessRule&, const ProcessRule&) = default;
};

// Those that every loop has.
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
  double sp = std::numeric_limits<double>::quiet_NaN();  // PV units, working; NaN: not known
  double pv = std::numeric_limits<double>::quiet_NaN();  // PV units; NaN: bad
  bool pv_good = false;
  bool pv_bad = false;          // neither: uncertain
  bool pv_frozen = false;       // does not change although CO moves
  bool pv_silent = false;       // bad, because nothing brings it
  bool output_arrives = false;  // the device has confirmed the newest command
  bool out_of_service = false;  // somebody tests the loop
  control::Fault fault = control::Fault::none;
  control::Mode mode = control::Mode::manual;            // in force
  control::Mode requested_mode = control::Mode::manual;  // by the operator
};

struct ProcessChange {
  AlarmKind kind = AlarmKind::bad_pv;
  bool on = false;
  std::uint64_t began = 0;  // period in which the condition first came; 0: not known

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

  // A condition from before a restart.
  void restore(AlarmKind kind, bool on) noexcept;

  ProcessChanges add(const ProcessCycle& cycle) noexcept;

  // The deviation is suppressed at present.
  // By the newest cycle.
  bool pv_lost() const noexcept {
    return at(AlarmKind::bad_pv).there || at(AlarmKind::source_lost).there;
  }
  bool deviation_rests() const noexcept { return limits_.rests(); }
  // How often the condition has come without a minute between, or while the alarm was on.
  std::uint32_t flaps(AlarmKind kind) const noexcept { return at(kind).flaps; }

 private:
  struct Delayed {
    bool on = false;                           // the alarm's condition
    bool there = false;                        // by the newest cycle that can tell
    std::optional<std::uint64_t> other_since;  // period since which a cycle says the other
    std::uint32_t flaps = 0;
    std::uint64_t began = 0;    // period in which the first of them came
    std::uint64_t gone_at = 0;  // period in which it last went
  };
  Delayed& at(AlarmKind kind) noexcept { return conditions_[index_of(kind) - kValveAlarmCount]; }
  const Delayed& at(AlarmKind kind) const noexcept {
    return conditions_[index_of(kind) - kValveAlarmCount];
  }
  // Nothing: the cycle can't tell.
  std::optional<bool> found(AlarmKind kind, const ProcessCycle& cycle) const noexcept;
  std::optional<bool> output_lost(const ProcessCycle& cycle) const noexcept;
  bool not_normal_mode(const ProcessCycle& cycle) const noexcept;
  void count(Delayed& condition, bool there, std::uint64_t period) const noexcept;
  // A cause of it is on.
  bool suppressed(AlarmKind kind) const noexcept;
  bool is_due(const Delayed& condition, const ProcessRule& rule,
              std::uint64_t period) const noexcept;

  double sample_time_s_;
  ProcessSettings settings_;
  LimitWatch limits_;
  std::uint64_t quiet_periods_;
  bool ever_arrived_ = false;  // a command, since the start
  bool ever_ran_ = false;      // in automatic, or into a fault
  std::array<Delayed, kProcessAlarmCount> conditions_{};
};

}  // namespace loopwarden::alarm
