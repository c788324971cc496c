// SPDX-License-Identifier: Apache-2.0
// The shape of a cycling signal.
//
// Between zero crossings, each half cycle is fitted by least squares with a half sine, a triangle
// and a flat top. The positions of peak or edges are fitted too. A sticking valve gives CO a
// triangle if the controller integrates. The quantity after the valve has a flat top: PV on a
// self-regulating process, the slope of PV on an integrating one. A linear loop gives sines (Q. P.
// He, J. Wang, M. Pottmann and S. J. Qin, Ind. Eng. Chem. Res. 46, 2007; M. Rossi and C. Scali, J.
// Process Control 15, 2005). If a valve jumps, the areas before and after the peak differ (A.
// Singhal and T. I. Salsbury, J. Process Control 15, 2005).
//
// The mean cycle gives harmonics: with x = a1 cos(wt) + a3 cos(3wt), a3/a1 is -1/3 for a square
// wave and +1/9 for a triangle.
//
// Limits: fewer than four half cycles, or fewer than four samples in each, have no shape.
#pragma once

#include <cstddef>
#include <span>

namespace loopwarden::diagnosis {

struct Waveform {
  std::size_t half_cycles = 0;
  double sine_error = 1.0;  // energy that each shape doesn't explain, 0 to 1
  double triangle_error = 1.0;
  double flat_error = 1.0;
  double area_ratio = 1.0;      // area before over after the peak, geometric mean
  double third_in_phase = 0.0;  // real part of c3/c1 with the phase of c1 taken out
  double third_across = 0.0;    // imaginary part, absolute value
  double second = 0.0;          // |c2/c1|
  double repeats = 0.0;         // share of the energy in the mean cycle, 0 to 1
  double kurtosis = 0.0;        // of the values, over whole half cycles
};

// Returns the shape. `period` in samples; movement shorter than a sixth of it is noise.
Waveform waveform(std::span<const double> x, double period);

}  // namespace loopwarden::diagnosis
