// SPDX-License-Identifier: Apache-2.0
// The limit cycle of a loop with backlash or stiction, predicted in the frequency domain.
//
//   L(jw) N(a) = -1     L of loop_frequency.hpp, N of describing_function.hpp
//
// A cycle with amplitude a of CO and frequency w is where the Nyquist curve meets -1/N(a). It is stable
// where -1/N, for growing a, leaves to the left of L for growing w (Loeb). PV's amplitude is
// a |N(a)| |G(jw)|.
//
// Where it says none: with a slip jump J, -1/N begins on the negative imaginary axis at pi S/(4 J) and stays left
// of it. A Nyquist curve that crosses this axis from the right, as that of a PI loop with Ti > T + L does, misses
// -1/N if it crosses nearer to 0 than that (AxisReach); one that comes from the left (Ti < T + L) meets it. The loop
// may cycle all the same: while the stem is stuck off the set point, CO ramps until it has crossed S, and the
// stem jumps by J. CO is then a long triangle with the steps of the P action, and no sinusoid. With backlash
// (J = 0) -1/N begins at infinity.
//
// Limits: it takes CO for a sinusoid and sees no second nonlinearity (limits, resolution).
// How far it is off is printed by `loopwarden limit-cycle --grid`.
//
// Sources: Gelb and Vander Velde (1968), ch. 3; Choudhury, Thornhill and Shah (2005). Olsson and Åström, IEEE
// Trans. Control Systems Technology 9 (2001), compare such predictions with exact cycles.
#pragma once

#include <complex>
#include <optional>
#include <string_view>
#include <vector>

#include "model/analysis/loop_frequency.hpp"

namespace loopwarden::analysis {

// The nonlinear valve; `s` is backlash's dead band where `backlash`.
struct ValveNonlinearity {
  bool backlash = false;
  double s = 0.0;  // CO units
  double j = 0.0;  // CO units

  std::complex<double> describing_function(double amplitude) const;
  double least_amplitude() const {
    return s / 2.0;
  }  // CO units, below which the valve stands still
};

// The valve effect that counts, of the model's own or of its scheduled faults at full severity.
std::optional<ValveNonlinearity> valve_nonlinearity(const plant::LoopModel& model);
// Whether an effect of that name is one that valve_nonlinearity() takes.
bool is_valve_nonlinearity(std::string_view effect) noexcept;

struct LimitCycle {
  double co_amplitude = 0.0;  // CO units
  double pv_amplitude = 0.0;  // PV units
  double period_s = 0.0;      // s
  bool stable = false;
};

// All cycles, by amplitude. Empty: none is predicted.
std::vector<LimitCycle> limit_cycles(const LinearLoop& loop, const ValveNonlinearity& valve);

// Distances from 0 at which the Nyquist curve crosses the negative imaginary axis, coming from the right, and at
// which -1/N begins there. loop < valve, in a stable loop: none is predicted.
struct AxisReach {
  double loop = 0.0;   // infinite: it comes from the left
  double valve = 0.0;  // infinite: without a slip jump
};
AxisReach axis_reach(const LinearLoop& loop, const ValveNonlinearity& valve);

// Points of -1/N for the drawing, from the least amplitude to `times` of it.
struct CriticalPoint {
  double amplitude;  // CO units
  std::complex<double> value;
};
std::vector<CriticalPoint> critical_locus(const ValveNonlinearity& valve, double times,
                                          std::size_t count);

}  // namespace loopwarden::analysis
