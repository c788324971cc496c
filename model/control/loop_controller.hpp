// SPDX-License-Identifier: Apache-2.0
// Computes the controller output from set point and process variable: modes, set point, PID law,
// stickband jacket, compensator and output limits, one period at a time.
//
// Modes:
//   manual     the output is the operator's request, within limits and rate
//   automatic  the PID law
//   fallback   the caller found a fault: the output is held, or moves to a stated value within the
//              rate limit
// Every change of mode is bumpless: the law starts from the output that was really written. As an
// option the set point follows PV in manual; on the way to automatic a set-point ramp restarts from
// PV.
//
// New settings are bumpless, too. In the first period after configure() the old settings are
// stepped in parallel, and the new law's integral takes over the difference: CO continues on the
// course of the old settings, for new gains, filter, action, set-point limits, jacket or
// compensator. The same holds if wider limits, a smaller deadband or a lifted rate limit would
// release an output that the old ones held. New limits that exclude CO are obeyed at the new rate
// limit; ControlCycle keeps such settings back.
//
// Order of one step: set point -> error -> jacket -> PID -> compensator -> limits. The
// compensator's correction is no windup. No call reads a clock, allocates or throws; the same calls
// give the same bits.
#pragma once

#include <cmath>
#include <cstdint>

#include "model/control/compensator.hpp"
#include "model/control/loop_state.hpp"
#include "model/control/output_limiter.hpp"
#include "model/control/pid.hpp"
#include "model/control/set_point.hpp"
#include "model/control/stickband_jacket.hpp"

namespace loopwarden::control {

// Action of the output during a fault.
struct OutputAction {
  enum class Kind : std::uint8_t { hold, value };
  Kind kind = Kind::hold;
  double value = 0.0;  // CO units

  static constexpr OutputAction hold() noexcept { return {}; }
  static constexpr OutputAction go_to(double value) noexcept { return {Kind::value, value}; }
  friend bool operator==(const OutputAction&, const OutputAction&) = default;
};

struct ControllerSettings {
  PidSettings pid;
  SetPointLimits set_point;
  OutputLimits output;
  JacketSettings jacket;
  CompensatorSettings compensator;
  bool set_point_tracks_in_manual = true;

  friend bool operator==(const ControllerSettings&, const ControllerSettings&) = default;
};

struct ControllerInputs {
  double process_variable = 0.0;       // PV units
  bool process_variable_valid = true;  // false only in manual: the output needs no PV there
  double valve_position = 0.0;         // CO units: read-back or stated valve model
  bool valve_position_valid = false;
  double read_back = 0.0;  // CO units, as measured: for planned_moves
  bool read_back_valid = false;
  MovesRequest moves{};  // newest request of planned moves
};

struct ControllerOutput {
  double output = 0.0;      // CO units, after all limits: what should go out
  double calculated = 0.0;  // CO units, before limits: the law's result with the correction, or the
                            // request in manual
  double set_point = 0.0;   // PV units, working set point
  double jacket_rate = 0.0;         // CO units/s that acted on the integral
  double jacket_shadow_rate = 0.0;  // CO units/s that the jacket asks for, acting or not
  double correction = 0.0;          // CO units that the compensator added
  double correction_shadow = 0.0;   // CO units that it asks for, acting or not
  Mode mode = Mode::manual;
  bool at_low = false;
  bool at_high = false;
  bool rate_limited = false;
};

class LoopController {
 public:
  // Starts in manual at `initial_output`. `period_s` > 0.
  LoopController(const ControllerSettings& settings, double period_s, double initial_set_point,
                 double initial_output) noexcept;

  void configure(const ControllerSettings& settings) noexcept;

  // Requests of the operator; non-finite values are ignored.
  void request_mode(Mode manual_or_automatic) noexcept;
  void request_set_point(double set_point) noexcept {
    law_.set_point.request(set_point);
    before_.set_point.request(set_point);
  }
  void request_output(double output) noexcept;  // for manual

  // The output is at `output`, CO units, for example at start-up.
  void assume_output(double output) noexcept;

  // Steps one period in the requested mode, or in fallback.
  ControllerOutput step(const ControllerInputs& in) noexcept;
  ControllerOutput step_fallback(OutputAction action) noexcept;

  // Sets the output written after the last step, with limits and resolution of the device. The
  // device's rounding (PidSettings::tolerance) does not move the start of the next rate-limited
  // step: a ramp slower than one count per period arrives.
  void applied(double output) noexcept {
    if (!std::isfinite(output)) return;
    if (std::abs(output - commanded_) > law_.settings.pid.tolerance) commanded_ = output;
    applied_ = output;
  }

  double output_applied() const noexcept { return applied_; }
  // The same before the device's rounding.
  double output_commanded() const noexcept { return commanded_; }
  // CO units: the request in manual; in other modes the output.
  double manual_output() const noexcept {
    return requested_ == Mode::manual ? manual_output_ : applied_;
  }
  double set_point_target() const noexcept { return law_.set_point.target(); }
  Mode requested_mode() const noexcept { return requested_; }
  Mode mode() const noexcept { return mode_; }
  const Compensator& compensator() const noexcept { return law_.compensator; }
  // Sample of the newest period for planned moves; null if they did not run in it.
  const MovesSample* moves_sample() const noexcept {
    const MoveHold* hold = law_.compensator.hold();
    return mode_ == Mode::automatic && hold != nullptr ? &hold->sample() : nullptr;
  }
  const StickbandJacket& jacket() const noexcept { return law_.jacket; }
  const ControllerSettings& settings() const noexcept { return law_.settings; }

 private:
  // The law of one set of settings, with its state.
  struct Law {
    struct Result {
      double wanted = 0.0;  // CO units, before limits, with what the compensator adds
      double set_point = 0.0;
      double jacket_rate = 0.0;
      double jacket_shadow_rate = 0.0;
      Correction correction;  // requested, acting or not
      double added = 0.0;     // CO units, by the compensator
    };

    Law(const ControllerSettings& settings, double period_s, double initial_set_point) noexcept;
    void configure(const ControllerSettings& settings) noexcept;
    // `applied`: the output that was really written one period ago, CO units; `commanded`: the
    // same before the device's rounding. `starts`: the law begins from there.
    Result step(const ControllerInputs& in, double applied, double commanded, bool starts) noexcept;
    // The integral takes over what the compensator had added: the output stays.
    void absorb_correction() noexcept;

    ControllerSettings settings;
    double period_s;
    Pid pid;
    SetPoint set_point;
    StickbandJacket jacket;
    Compensator compensator;
    double added = 0.0;          // CO units, by the compensator
    bool hold_integral = false;  // requested by the compensator
  };

  ControllerOutput step_automatic(const ControllerInputs& in) noexcept;
  ControllerOutput step_manual(const ControllerInputs& in) noexcept;
  ControllerOutput limit(double wanted) noexcept;
  double kept_on_course(double wanted) const noexcept;
  void set_output(double output) noexcept {
    applied_ = output;
    commanded_ = output;
  }

  double period_s_;
  Law law_;
  Law before_;                // of the settings before configure()
  bool taking_over_ = false;  // configure() was called since the last step
  Mode requested_ = Mode::manual;
  Mode mode_ = Mode::manual;
  double manual_output_;  // CO units
  double applied_;        // CO units, the output really written
  double commanded_;      // CO units, the same before the device's rounding
};

}  // namespace loopwarden::control
