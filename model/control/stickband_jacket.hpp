// SPDX-License-Identifier: Apache-2.0
// The stickband jacket: a compensator for valve stiction that acts only inside the integrator.
//
//   dI/dt = Ki e + w        w  the jacket's rate, CO units/s, by one of three forms
//
//   paper    the published law; acts in `simulate` and `compare` only, since it can park the loop
//            off its set point; a running loop has it in shadow
//   bounded  the same, at most half of the integral action, with a dead zone
//   dwell    integrates slowly after a slip that has halved the error
//
// docs/math/stickband-jacket.md has the equations, the reasons and the sources. Figures over random
// loops: `loopwarden-study calm`, docs/explanation/compensators.md. Advice for the settings:
// docs/how-to/steady-a-sticking-valve.md.
//
// bounded and dwell are off (w = 0) while the valve position is not valid, and while the mean error
// exceeds `max_mean_error` (first-order mean over `mean_error_time_s`; on again below half).
// A non-finite valve position counts as not valid, and a non-finite e gives w = 0.
//
// Limits: the jacket removes no friction, and the loop may still cycle. A loop that reverses before
// PV has settled after a slip may get worse. The mean error of `dwell` is not zero. A read-back
// that freezes with a good status looks like a stuck valve. A read-back later than PV gives a wrong
// slip error. Without a read-back the jacket is as good as the model of the valve.
#pragma once

#include <limits>

#include "model/control/loop_state.hpp"

namespace loopwarden::control {

struct JacketSettings {
  JacketForm form = JacketForm::off;
  bool shadow = false;      // computed and recorded, but not acting
  double gain_per_s = 1.0;  // Ks, 1/s
  double dead_zone = 0.0;   // z, CO units
  double max_mean_error = std::numeric_limits<double>::infinity();  // PV units
  double mean_error_time_s = 60.0;                                  // s

  friend bool operator==(const JacketSettings&, const JacketSettings&) = default;
};

struct JacketInputs {
  double error = 0.0;           // e, PV units
  double integral_rate = 0.0;   // Ki e, CO units/s
  double output = 0.0;          // u, CO units
  double valve_position = 0.0;  // x, CO units
  bool valve_position_valid = false;
};

class StickbandJacket {
 public:
  StickbandJacket(const JacketSettings& settings, double period_s) noexcept;

  // Another form resets the jacket; other changes keep its state.
  void configure(const JacketSettings& settings) noexcept;
  void reset() noexcept;

  // Steps one period. Returns w, CO units/s, acting or in shadow (see settings().shadow).
  double step(const JacketInputs& in) noexcept;

  // The mean error is above its limit: the jacket is off.
  bool standing_back() const noexcept { return standing_back_; }
  double mean_error() const noexcept { return mean_error_; }
  const JacketSettings& settings() const noexcept { return settings_; }

 private:
  // The stem as the read-back shows it.
  struct Stem {
    bool known = false;
    bool stuck = false;       // now
    bool was_stuck = false;   // at any time since it last moved
    bool crossed = false;     // the error has changed sign against e_s since then
    double position = 0.0;    // x_r, CO units
    double output = 0.0;      // u_r, CO units
    double error = 0.0;       // one period ago, PV units
    double slip_error = 0.0;  // e_s, PV units; 0: not known
  };

  void watch_mean_error(double error) noexcept;
  void watch_stem(const JacketInputs& in) noexcept;
  double bounded_rate(const JacketInputs& in) const noexcept;
  double dwell_rate(const JacketInputs& in) const noexcept;

  JacketSettings settings_;
  double period_s_;
  double mean_error_ = 0.0;  // PV units
  bool standing_back_ = false;
  Stem stem_;
};

}  // namespace loopwarden::control
