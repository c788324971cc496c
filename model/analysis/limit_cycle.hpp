// SPDX-License-Identifier: Apache-2.0
// The limit cycle of a loop with backlash or stiction, predicted in the frequency domain.
//
//   L(jw) N(a) = -1     L of loop_frequency.hpp, N of describing_function.hpp
//
// The intersections of the Nyquist curve with -1/N(a) are cycles with the amplitude a of CO and the
// frequency w. A cycle is stable if -1/N, for growing a, leaves to the left of L for growing w
// (Loeb). The amplitude of PV is a |N(a)| |G(jw)|.
//
// A loop can cycle although no cycle is predicted. With a slip jump J, -1/N begins on the negative
// imaginary axis at pi S/(4 J) and stays left of it. The Nyquist curve of a PI loop with Ti > T + L
// crosses this axis from the right. It misses -1/N if it crosses nearer to 0 than that (AxisReach).
// A curve from the left (Ti < T + L) meets -1/N. If there is no intersection, the loop can still
// cycle: while the stem is stuck off the set point, CO ramps until it has crossed S, and the stem
// jumps by J. CO is then a long triangle with the steps of the P action, not a sinusoid. With
// backlash (J = 0) -1/N begins at infinity.
//
// Limits: CO counts as a sinusoid, and only one nonlinearity is considered (no limits, no
// resolution). `loopwarden limit-cycle --grid` prints the error of the prediction.
//
// Sources: Gelb and Vander Velde (1968), ch. 3; Choudhury, Thornhill and Shah (2005). Olsson and
// Åström, IEEE Trans. Control Systems Technology 9 (2001), compare such predictions with exact
// cycles.
#pragma once

#include <complex>
#include <optional>
#include <string_view>
#include <vector>

#include "model/analysis/loop_frequency.hpp"

namespace loopwarden::analysis {

// The nonlinear valve. For backlash, `s` is the dead band.
struct ValveNonlinearity {
  bool backlash = false;
  double s = 0.0;  // CO units
  double j = 0.0;  // CO units

  std::complex<double> describing_function(double amplitude) const;
  double least_amplitude() const {
    return s / 2.0;
  }  // CO units, below which the valve doesn't move
};

// Returns the valve effect of the model, or of its scheduled faults at full severity; empty if it
// has no such effect.
std::optional<ValveNonlinearity> valve_nonlinearity(const plant::LoopModel& model);
// Returns whether valve_nonlinearity() considers effects of that name.
bool is_valve_nonlinearity(std::string_view effect) noexcept;

// A predicted cycle.
struct LimitCycle {
  double co_amplitude = 0.0;  // CO units
  double pv_amplitude = 0.0;  // PV units
  double period_s = 0.0;      // s
  bool stable = false;
};

// Returns all predicted cycles, sorted by amplitude; empty if no cycle is predicted.
std::vector<LimitCycle> limit_cycles(const LinearLoop& loop, const ValveNonlinearity& valve);

// Distances from 0 on the negative imaginary axis: of the crossing of the Nyquist curve from the
// right, and of the beginning of -1/N. If the loop is stable and loop < valve, no cycle is
// predicted.
struct AxisReach {
  double loop = 0.0;   // infinite: the curve crosses from the left
  double valve = 0.0;  // infinite: no slip jump
};
// Returns both distances.
AxisReach axis_reach(const LinearLoop& loop, const ValveNonlinearity& valve);

// Returns `count` points of -1/N for a drawing, from the least amplitude to `times` the least
// amplitude.
struct CriticalPoint {
  double amplitude;  // CO units
  std::complex<double> value;
};
std::vector<CriticalPoint> critical_locus(const ValveNonlinearity& valve, double times,
                                          std::size_t count);

}  // namespace loopwarden::analysis
