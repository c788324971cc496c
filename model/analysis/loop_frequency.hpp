// SPDX-License-Identifier: Apache-2.0
// The linear part of a loop in the frequency domain: open loop, margins.
//
//   L(jw) = C(jw) G(jw)
//   C(jw) = kp + ki h/(1 - z^-1) + kd/h (1 - z^-1) (1 - a)/(1 - a z^-1)
//           z = exp(j w h), a = exp(-h/Tf)
//   G(jw) = K exp(-j w D) / ((1 + j w T) (1 + j w T_i) ...) (1 - z^-1)/(j w h)
//
//   K  |gain|, PV units / CO unit (integrating: / (CO unit s))     T, T_i  s, lags
//   D  s, dead time     h  s, sampling period     w  rad/s, up to pi/h
//   integrating   K/(j w) replaces K/(1 + j w T)
//
// This is the law of pid.hpp on the process, with its output held over each period. Aliases of G
// are ignored. A loop model contributes gain, lags and dead time of the process, gain_change and
// extra_dead_time of the process, extra_lag and positioner_lag. Every other effect counts as 1, and
// its name is in `left_out`.
//
// Margins:  gain_margin   1/|L| at the first crossing of the phase with -180 deg
//           phase_margin  180 deg + phase of L at the last crossing of |L| with 1 from above
//           delay_margin  phase margin / that frequency: further dead time to instability, s
//           sensitivity   Ms = max 1/|1 + L|
// A margin is infinite without such a crossing. `stable` means a gain margin above 1 and a phase
// margin above 0. That is sufficient for a stable or an integrating process with one crossing of
// each kind.
//
// Source: Åström and Hägglund, Advanced PID Control (2006), ch. 4; Åström and Wittenmark,
// Computer-Controlled Systems (1997), section 3.3.
#pragma once

#include <complex>
#include <limits>
#include <string>
#include <vector>

#include "model/plant/loop_model.hpp"

namespace loopwarden::analysis {

struct LinearLoop {
  control::PidGains gains;
  double gain = 1.0;  // K
  bool integrating = false;
  double dead_time_s = 0.0;  // D
  std::vector<double> lags_s;
  double sample_time_s = 0.1;         // h
  std::vector<std::string> left_out;  // effects of the model that the linear loop ignores

  std::complex<double> controller(double w) const;
  std::complex<double> process(double w) const;  // includes the hold
  std::complex<double> open_loop(double w) const { return controller(w) * process(w); }
};

// Returns the linear part of a loop model.
LinearLoop linear_loop(const plant::LoopModel& model);

struct Margins {
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  double gain_margin = kNone;
  double phase_margin_deg = kNone;
  double phase_margin_at = 0.0;  // rad/s
  double delay_margin_s = kNone;
  double sensitivity = 0.0;  // Ms
  bool stable = true;
};

// Returns the margins of the loop.
Margins margins(const LinearLoop& loop);

// Returns `count` logarithmic frequencies, rad/s, from 1/1000 of the slowest corner to the limit
// pi/h of the sampling.
std::vector<double> frequencies(const LinearLoop& loop, std::size_t count);

}  // namespace loopwarden::analysis
