// SPDX-License-Identifier: Apache-2.0
// The limit cycle of a loop with backlash or stiction, predicted in the frequency domain.
//
//   L(jw) N(a) = -1     L of loop_frequency.hpp, N of describing_function.hpp
//
// A cycle with amplitude a of CO and frequency w is where the Nyquist curve meets -1/N(a). It is stable
// where -1/N, for growing a, leaves to the left of L for growing w (Loeb). PV's amplitude is
// a |N(a)| |G(jw)|.
//
// What it can't do: it takes CO for a sinusoid and sees no second nonlinearity (limits, resolution).
// How far it is off is printed by `loopwarden limit-cycle --grid`.
//
// Source: Gelb and Vander Velde (1968), ch. 3; Choudhury, Thornhill and Shah (2005).
#pragma once

#include <complex>
#include <optional>
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

struct LimitCycle {
  double co_amplitude = 0.0;  // CO units
  double pv_amplitude = 0.0;  // PV units
  double period_s = 0.0;      // s
  bool stable = false;
};

// All cycles, by amplitude. Empty: none is predicted.
std::vector<LimitCycle> limit_cycles(const LinearLoop& loop, const ValveNonlinearity& valve);

// Points of -1/N for the drawing, from the least amplitude to `times` of it.
struct CriticalPoint {
  double amplitude;  // CO units
  std::complex<double> value;
};
std::vector<CriticalPoint> critical_locus(const ValveNonlinearity& valve, double times,
                                          std::size_t count);

}  // namespace loopwarden::analysis
