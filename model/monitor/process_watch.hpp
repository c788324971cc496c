// SPDX-License-Identifier: Apache-2.0
// Whether a loop does its work: the conditions of its process alarms, from its cycles.
//
//   bad_pv           PV is bad, in every mode, while the loop starts too; or it is uncertain and that is the loop's fault
//   output_lost      commands don't reach the device. Before the first one has, only a loop that has its PV and still can't
//                    start tells; a loop that has nothing to write yet has lost nothing
//   output_unknown   where the output stands is not known; a graver fault hides it
//   not_normal_mode  the mode in force is another one than the loop's normal mode: fallback is never normal
//
// A condition comes once it has been there for kProcessDelay without a break, and goes once it has been gone for as long:
// what comes and goes faster changes nothing, and no alarm comes more than three times a minute, from where on ISA-18.2
// speaks of chattering. Time is the loop's own, counted in its periods; between two cycles the first one holds. What a
// cycle can't tell changes nothing and starts the delay anew.
//
// Stepped once a cycle. No clock, no allocation.
//
// Errors: none.
// What it can't do: say why the output is lost; a record's row does not hold it.
//
// Source: on-delay and off-delay as in ANSI/ISA-18.2-2016 (basic alarm design) and EEMUA 191 (2013), chapter 8; the
// 10 s are ours: longer than a reconnection or a late reply, shorter than what a process bears.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"
#include "model/monitor/alarm_kind.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::monitor {

inline constexpr double kProcessDelay_s = 10.0;  // to come, and to go

enum class NormalMode : std::uint8_t { automatic, manual, any };

constexpr const char* to_text(NormalMode mode) noexcept {
  return numeric::enum_name<NormalMode::any>(mode, {"automatic", "manual", "any"});
}

struct ProcessCycle {
  std::uint64_t period_index = 0;
  bool pv_good = false;
  bool pv_bad = false;          // neither: uncertain
  bool output_arrives = false;  // the device has confirmed the newest command
  control::Fault fault = control::Fault::none;
  control::Mode mode = control::Mode::manual;            // in force
  control::Mode requested_mode = control::Mode::manual;  // by the operator
};

struct ProcessChange {
  AlarmKind kind = AlarmKind::bad_pv;
  bool on = false;

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
  ProcessWatch(double sample_time_s, NormalMode normal_mode) noexcept;

  // A condition from before a restart.
  void restore(AlarmKind kind, bool on) noexcept { at(kind).on = on; }

  ProcessChanges add(const ProcessCycle& cycle) noexcept;

 private:
  struct Delayed {
    bool on = false;
    std::optional<std::uint64_t> other_since;  // period since which a cycle says the other
  };
  Delayed& at(AlarmKind kind) noexcept { return conditions_[index_of(kind) - kValveAlarmCount]; }
  // Nothing: the cycle can't tell.
  std::optional<bool> found(AlarmKind kind, const ProcessCycle& cycle) const noexcept;
  std::optional<bool> output_lost(const ProcessCycle& cycle) const noexcept;

  NormalMode normal_mode_;
  std::uint64_t delay_periods_;
  bool ever_arrived_ = false;  // a command, since the start
  std::array<Delayed, kProcessAlarmCount> conditions_{};
};

}  // namespace loopwarden::monitor
