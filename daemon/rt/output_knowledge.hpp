// SPDX-License-Identifier: Apache-2.0
// Tracks whether the position of the output is known, so that no command starts from a guess.
#pragma once

#include <cstdint>
#include <optional>

#include "model/control/loop_controller.hpp"
#include "model/control/supervisor.hpp"

namespace loopwarden::daemon::rt {

// State of one loop's output: valid if its position is known, reported if an operator set it,
// lost while commands don't reach the valve.
//
// The position becomes invalid if commands don't reach the valve, if the process paused, or while
// commands are withheld: the watchdog of the device may have moved the valve meanwhile. It also is
// invalid at the start, because anybody may move the valve before the first command.
// The loop writes no command until one of these sources gives the position:
// - a good read-back that was measured after the loss;
// - an output that an operator sets;
// - the value of the stop action: after a loop with a read-back has waited for one, at once in a
//   loop without;
// - the configured start value, if no position was ever known.
// A loop without a read-back keeps its last output as its position after a loss.
//
// Real-time: no allocation, lock or exception. Times are CLOCK_MONOTONIC.
class OutputKnowledge {
 public:
  struct ReadBack {
    bool fitted = false;       // the loop has one
    bool good = false;         // quality, value and age
    double value = 0.0;        // CO units
    std::int64_t time_ns = 0;  // of the measurement
  };

  // Conditions of one cycle.
  struct Cycle {
    std::int64_t now_ns = 0;
    control::Fault fault = control::Fault::none;  // in force
    control::OutputAction action;                 // of the fault
    bool output_lost = false;                     // commands don't reach the valve
    bool late_cycle = false;                      // the process paused
    bool started = false;   // a good PV and a reachable valve were seen together
    bool withhold = false;  // no command may be written in this cycle
    ReadBack read_back;
    double max_age_s = 0.0;  // s, longest wait for a read-back at a stop
  };

  // `at_start`: the configured start value; hold if the file has no value.
  explicit OutputKnowledge(const control::OutputAction& at_start) noexcept : at_start_(at_start) {}

  // Steps one cycle. Returns the position, in CO units, if the cycle found it.
  std::optional<double> update(const Cycle& cycle) noexcept;

  // An operator set the output. Returns true if the position was unknown and is now the set value.
  bool report() noexcept;

  void set_command_written() noexcept { command_written_ = true; }
  void set_result_rejected(bool rejected) noexcept { result_rejected_ = rejected; }

  bool valid() const noexcept { return valid_; }
  // An operator gave the position after the last loss.
  bool reported() const noexcept { return reported_; }
  // A command was written since the start.
  bool command_written() const noexcept { return command_written_; }
  // The newest result of the controller was not finite or out of range, and was not written.
  bool result_rejected() const noexcept { return result_rejected_; }

 private:
  void withhold(const Cycle& cycle) noexcept;
  void invalidate(const Cycle& cycle) noexcept;
  std::optional<double> find(const Cycle& cycle) const noexcept;

  control::OutputAction at_start_;
  bool valid_ = false;
  bool ever_valid_ = false;
  bool reported_ = false;
  bool lost_ = false;                  // in the newest cycle
  std::int64_t invalid_since_ns_ = 0;  // older read-backs don't count
  bool withheld_ = false;
  bool valid_before_withheld_ = false;
  bool command_written_ = false;
  bool result_rejected_ = false;
};

}  // namespace loopwarden::daemon::rt
