// SPDX-License-Identifier: Apache-2.0
// Fits a process, with and without a sticking valve, from CO to PV in free run. Equations and
// sources: docs/math/valve-evidence.md.
//
// Limits: this indicator is weak without the others, as a valve model fits loads too. It has no
// second order, and no gain or load that change.
#pragma once

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
