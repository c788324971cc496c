// SPDX-License-Identifier: Apache-2.0
// Adds short pulses to CO that break a sticking valve loose (kind `knocker`). It acts in `simulate`
// and `compare` only; a running loop has it in shadow.
//
//   u = uc + uk
//   uk = a sign(uc(t) - uc(tp))   from tp + hk, for tau seconds; otherwise 0
//
//   u, uc, uk, a  CO units     hk  pulse_period_s, s     tau  pulse_width_s, s, < hk
//   tp  onset of the last pulse
//
// The sign is taken once, at the onset. If uc has not moved there is no pulse. Hägglund's advice:
// hk two to five sampling periods of the controller, tau one to two, a 1 to 4 % of the range, less
// than the stick band. Each pulse disturbs PV by as much as a tau (1 - exp(-...)) lets through.
//
// Limits: it pulses a healthy valve as well, every hk; the stem travels.
//
// Source: Hägglund, Control Engineering Practice 10 (2002) 1237-1243; thesis, equations 4.1 to 4.4.
#pragma once

#include "model/control/compensator_contract.hpp"

namespace loopwarden::control {

class Knocker {
 public:
  Knocker(const CompensatorSettings& settings, double period_s) noexcept
      : amplitude_(settings.amplitude),
        pulse_period_s_(settings.pulse_period_s),
        pulse_width_s_(settings.pulse_width_s),
        period_s_(period_s) {}

  void reset(double output) noexcept {
    at_last_pulse_ = output;
    since_onset_s_ = 0.0;
    sign_ = 0.0;
  }

  Correction step(const CompensatorInputs& in) noexcept {
    since_onset_s_ += period_s_;
    // Half a period of slack for the sum of rounded periods.
    if (since_onset_s_ >= pulse_period_s_ - 0.5 * period_s_) {
      const double moved = in.output - at_last_pulse_;
      sign_ = moved > 0.0 ? 1.0 : moved < 0.0 ? -1.0 : 0.0;
      at_last_pulse_ = in.output;
      since_onset_s_ = 0.0;
    }
    const bool pulse = since_onset_s_ < pulse_width_s_ - 0.5 * period_s_;
    return {.added = pulse ? amplitude_ * sign_ : 0.0};
  }

 private:
  double amplitude_;            // CO units
  double pulse_period_s_;       // s
  double pulse_width_s_;        // s
  double period_s_;             // s
  double at_last_pulse_ = 0.0;  // CO units
  double since_onset_s_ = 0.0;  // s
  double sign_ = 0.0;
};

}  // namespace loopwarden::control
