// SPDX-License-Identifier: Apache-2.0
// Oscillatory process: second order in place of the lag (effect `oscillatory_process`).
//
//   y'' + 2 Z W y' + W^2 y = W^2 u,   solved exactly for u held over a period
//   x(k) = (y(k+1) - a y(k)) / (1 - a),   a = exp(-h/T):   the input that makes the lag's output y
//
//   u, x, y  CO units, at the input of the process     Z  damping ratio, 0 < Z < 1
//   W  natural_frequency, rad/s, > 0     T  time constant of the lag, s, > 0     h  s
//
// The process with its lag follows, so the transfer function from CO to PV is
//   K W^2 e^(-L p) / (p^2 + 2 Z W p + W^2)
// Occurs if two stores exchange energy or mass (U-tubes, connected tanks, gas above a liquid), or
// if PV is inside another loop that rings.
//
// Severity p fades it in as u + p (x - u).
// Errors: no exceptions; if u is not finite, neither is x until the next reset.
// Limits: linear, so the ringing is proportional to the move. If the dead time of the process is
// not a whole number of periods, y has the error of the lag's interpolation between two samples.
//
// Source: Seborg, Edgar and Mellichamp, Process Dynamics and Control (2004), chapter 5 (underdamped
// second order); Franklin, Powell and Workman, Digital Control of Dynamic Systems (1998),
// zero-order hold.
#pragma once

#include <cmath>

#include "model/effects/positioner_overshoot/positioner_overshoot.hpp"

namespace loopwarden::effects {

class OscillatoryProcess {
 public:
  OscillatoryProcess(double damping, double natural_frequency_rad_s, double time_constant_s,
                     double period_s) noexcept
      : second_order_(damping, natural_frequency_rad_s, period_s),
        keep_(std::exp(-period_s / time_constant_s)) {}

  void set_severity(double severity) noexcept { severity_ = severity; }
  double reset(double u) noexcept { return y_ = second_order_.reset(u); }
  double step(double u) noexcept {
    const double next = second_order_.step(u);
    const double x = (next - keep_ * y_) / (1.0 - keep_);
    y_ = next;
    return u + severity_ * (x - u);
  }

 private:
  PositionerOvershoot second_order_;
  double keep_;     // a
  double y_ = 0.0;  // CO units
  double severity_ = 1.0;
};

}  // namespace loopwarden::effects
