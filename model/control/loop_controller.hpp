// SPDX-License-Identifier: Apache-2.0
// What turns set point and process variable into a controller output: modes, set point, PID law,
// stickband jacket, compensator and output limits, one period at a time.
//
// Modes:
//   manual     the output is what the operator asks for, within limits and rate
//   automatic  the PID law
//   fallback   the caller found a reason not to trust the loop; the output is held or goes to a
//              stated value, within the rate limit
// Every change of mode is bumpless: the law starts from the output that really stands. In manual
// by option the set point follows PV; on the way to automatic a set-point ramp starts again from PV.
//
// New settings are bumpless, too. In the first period after configure() the old settings are run
// beside the new ones, and the new law's integral takes over the difference: CO goes on where the old
// settings would have had it, whatever the new gains, filter, action, set-point limits, jacket or
// compensator say. The same where wider limits, a smaller deadband or a lifted rate limit would let
// an output go that they held. New limits that exclude CO are obeyed at the new rate limit: the
// caller keeps such settings back (ControlCycle does).
//
// Order of one step: set point -> error -> jacket -> PID -> compensator -> limits. What the compensator
// adds is no windup. Nothing here reads a clock,
// allocates, or throws; the same calls give the same bits.
#pragma once

#include <cmath>
#include <cstdint>

#include "model/control/compensator.hpp"
#include "model/control/output_limiter.hpp"
#include "model/control/pid.hpp"
#include "model/control/set_point.hpp"
#include "model/control/stickband_jacket.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::control {

enum class Mode : std::uint8_t { manual, automatic, fallback };

constexpr const char* to_text(Mode mode) noexcept {
  return numeric::enum_name<Mode::fallback>(mode, {"MAN", "AUTO", "FALLBACK"});
}

// What the output does while something is wrong.
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
};

struct ControllerOutput {
  double output = 0.0;       // CO units, after all limits: what should go out
  double calculated = 0.0;   // CO units, before limits: the law's result with what the compensator
                             // adds, or what was asked for
  double set_point = 0.0;    // PV units, working set point
  double jacket_rate = 0.0;  // CO units/s that acted on the integral
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

  // Operator's wishes; non-finite values change nothing.
  void request_mode(Mode manual_or_automatic) noexcept;
  void request_set_point(double set_point) noexcept {
    law_.set_point.request(set_point);
    before_.set_point.request(set_point);
  }
  void request_output(double output) noexcept;  // for manual

  // Without knowledge of what the loop did before (start-up): the output now stands at `output`.
  void assume_output(double output) noexcept;

  // One period in the wished mode, or in fallback.
  ControllerOutput step(const ControllerInputs& in) noexcept;
  ControllerOutput step_fallback(OutputAction action) noexcept;

  // What really went out after the last step: limits and resolution of the device included. The
  // device's rounding (PidSettings::tolerance) does not move the start of the next rate-limited step:
  // a ramp slower than one count a period arrives all the same.
  void applied(double output) noexcept {
    if (!std::isfinite(output)) return;
    if (std::abs(output - commanded_) > law_.settings.pid.tolerance) commanded_ = output;
    applied_ = output;
  }

  double output_applied() const noexcept { return applied_; }
  // The same before the device's rounding.
  double output_commanded() const noexcept { return commanded_; }
  // CO units: what manual holds or goes to, as it was requested; in other modes the output.
  double manual_output() const noexcept {
    return requested_ == Mode::manual ? manual_output_ : applied_;
  }
  double set_point_target() const noexcept { return law_.set_point.target(); }
  Mode requested_mode() const noexcept { return requested_; }
  Mode mode() const noexcept { return mode_; }
  const Compensator& compensator() const noexcept { return law_.compensator; }
  const StickbandJacket& jacket() const noexcept { return law_.jacket; }
  const ControllerSettings& settings() const noexcept { return law_.settings; }

 private:
  // What one set of settings makes of the inputs, with all that it remembers.
  struct Law {
    struct Result {
      double wanted = 0.0;  // CO units, before limits, with what the compensator adds
      double set_point = 0.0;
      double jacket_rate = 0.0;
      double jacket_shadow_rate = 0.0;
      Correction correction;  // wanted, acting or not
      double added = 0.0;     // CO units, by the compensator
    };

    Law(const ControllerSettings& settings, double period_s, double initial_set_point) noexcept;
    void configure(const ControllerSettings& settings) noexcept;
    // `applied`: the output that was really written one period ago, CO units; `commanded`: the
    // same before the device's
    // rounding. `starts`: the law begins from there.
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
    bool hold_integral = false;  // the compensator's wish
  };

  ControllerOutput step_automatic(const ControllerInputs& in) noexcept;
  ControllerOutput step_manual(const ControllerInputs& in) noexcept;
  ControllerOutput limit(double wanted) noexcept;
  double kept_on_course(double wanted) const noexcept;
  void stand_at(double output) noexcept {
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
  double applied_;        // CO units, what really went out
  double commanded_;      // CO units, the same before the device's rounding
};

}  // namespace loopwarden::control
