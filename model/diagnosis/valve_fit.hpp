// SPDX-License-Identifier: Apache-2.0
// Fits a process, with and without a sticking valve, from CO to PV in free run.
//
//   v = CO                                   no valve effect
//   v = play(CO, s)                          backlash
//   v = stiction(CO, s, j)                   stiction (stiction_choudhury.hpp), s and j on a grid
//   z(k) = a z(k-1) + (1 - a) v(k - d),  1 - a -> 1 at a = 1 (integrating);  PV = K z + slow load
//
// K is from least squares, with the sign that the controller's action requires. Pole a and dead
// time d are on a grid, the same for all three. Both sides have the same high-pass, which removes
// the slow load. Fits are judged twice: as they are, and with errors whitened by 1 - 0.9 q^-1,
// which takes a random load into account. All three have the same freedom of phase, so the gain
// of a valve effect is its shape.
//
// Source: the scheme of R. Srinivasan, R. Rengaswamy, S. Narasimhan and R. Miller, Ind. Eng. Chem.
// Res. 44 (2005), and M. Jelali, J. Process Control 18 (2008), with grids in place of a global
// search.
//
// Limits: this indicator is weak without the others, as a valve model fits loads too. It has no
// second order, and no gain or load that change.
#pragma once

#include <cstddef>

#include "model/diagnosis/preparation.hpp"

namespace loopwarden::diagnosis {

struct FitQuality {
  double free = 0.0;      // R^2 of PV in free run, 0 to 1
  double whitened = 0.0;  // R^2 with whitened errors, 0 to 1
};

struct ValveFit {
  FitQuality linear;
  FitQuality backlash;
  FitQuality stiction;
  double integrating_gain =
      0.0;                 // free R^2 of the best integrating fit less that of the best other
  double dead_time = 0.0;  // of the best linear fit, periods
  // Of the best valve effect:
  double s = 0.0;                  // CO units
  double j = 0.0;                  // CO units
  double backlash_deadband = 0.0;  // CO units, of the best backlash
  double output_range = 0.0;       // CO units, of CO about its slow course, from 3 to 97 %
  double band_share = 0.0;         // s over the range of CO
  double pole_share = 0.0;         // time constant over the period; 3 if integrating
};

// Returns the fit. `action` as in ControllerFit.
ValveFit fit_valve(const Prepared& prepared, double action);

}  // namespace loopwarden::diagnosis
