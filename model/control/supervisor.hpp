// SPDX-License-Identifier: Apache-2.0
// Decides in each period whether the loop may run, or which action the output takes instead.
//
// Faults, the most severe first. Each has one action: hold the output, or move it to a stated
// value.
//
//   stop         the daemon is ending (SIGTERM, SIGINT)
//   enable_open  the enable contact is open
//   not_finite   the controller's result was not a number
//   late_cycle   the cycle was more than `late_cycle_periods` late, once the loop has started
//   output_lost  commands do not reach the positioner
//   bad_pv       the process variable is bad, or uncertain if that counts as bad; the output is
//                held for `bad_pv_hold_s` after PV became bad before the action takes place
//   starting     a good PV and a reachable positioner have not been seen together since start-up:
//                no command leaves until then
//   output_unknown  the output's position is not known: no command leaves, the output is held
//
// A fault ends when its cause has been absent for `recovery_delay_s`. Then the loop returns to the
// mode it had, or to manual if `recovery` requires it. The transfer is bumpless
// (loop_controller.hpp). `starting` and `output_unknown` end with their cause, and the loop keeps
// its mode.
#pragma once

#include <cstdint>

#include "model/control/loop_controller.hpp"

namespace loopwarden::control {

enum class Recovery : std::uint8_t { previous_mode, manual };

struct SafetySettings {
  OutputAction on_stop;
  OutputAction on_enable_open;
  OutputAction on_not_finite;
  OutputAction on_late_cycle;
  OutputAction on_output_lost;
  OutputAction on_bad_pv;
  double bad_pv_hold_s = 0.0;  // s, >= 0
  bool uncertain_is_good = false;
  Recovery recovery = Recovery::manual;
  double recovery_delay_s = 1.0;  // s, >= 0
  std::uint32_t late_cycle_periods = 3;

  friend bool operator==(const SafetySettings&, const SafetySettings&) = default;
};

struct Conditions {
  bool stop = false;
  bool enable_open = false;
  bool not_finite = false;  // of the cycle before
  bool late_cycle = false;
  bool output_lost = false;
  bool pv_good = false;
};

struct Decision {
  Fault fault = Fault::starting;
  OutputAction action;     // during a fault
  bool to_manual = false;  // the fault just ended and the loop is to wait in manual
};

class Supervisor {
 public:
  Supervisor(const SafetySettings& settings, double period_s) noexcept
      : settings_(settings), period_s_(period_s) {}

  void configure(const SafetySettings& settings) noexcept { settings_ = settings; }
  // One period: `step`, and then `settle` with whether the output's position is known. The fault
  // found by `step` decides which sources of the position count. While the position is not known,
  // only the action of stop takes place.
  Decision step(const Conditions& conditions) noexcept;
  Decision settle(Decision decision, bool output_known) noexcept;
  // A good PV and a reachable positioner have been seen together.
  bool started() const noexcept { return started_; }
  Fault fault() const noexcept {
    return fault_ == Fault::none && !output_known_ ? Fault::output_unknown : fault_;
  }

 private:
  Fault gravest(const Conditions& conditions) const noexcept;
  OutputAction action() const noexcept;
  void watch_pv(bool good) noexcept;
  double seconds(std::uint64_t periods) const noexcept {
    return static_cast<double>(periods) * period_s_;
  }

  SafetySettings settings_;
  double period_s_;
  Fault fault_ = Fault::starting;  // never output_unknown, which follows from output_known_
  bool output_known_ = true;
  bool started_ = false;
  // Whole periods, so that a delay ends in the period in which it should.
  std::uint64_t gone_periods_ = 0;     // since the cause of the present fault ended
  std::uint64_t pv_bad_periods_ = 0;   // since PV became bad, more severe faults included
  std::uint64_t pv_good_periods_ = 0;  // since it became good
};

}  // namespace loopwarden::control
