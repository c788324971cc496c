// SPDX-License-Identifier: Apache-2.0
// One run of a loop with or without the stickband jacket, measured.
//
// The set point of the model's scenario moves every `hold_s`. After each move `settling_s` is left
// out; what follows is measured for each set point and averaged over them. PV is the true one,
// before the transmitter's noise: what flows in the pipe. The controller must be in reverse action.
#pragma once

#include "model/analysis/loop_metrics.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::studies {

// Errors of the positioner's read-back.
struct ReadBackErrors {
  double bias = 0.0;        // CO units
  double noise = 0.0;       // CO units, standard deviation
  double resolution = 0.0;  // CO units
};

struct CalmTrial {
  plant::LoopModel model;  // controller.jacket: the form to try; scenario.duration_s is not used
  ReadBackErrors read_back;
  double output_resolution = 0.0;  // CO units, of the converter that CO goes through
  double hold_s = 2700.0;          // s, time at each set point
  std::size_t unmeasured = 0;      // set points in the beginning that are not measured
  double settling_s = 900.0;       // s, left out of it
};

struct TrialResult {
  // Means over the set points; rms_error is the root mean square, the period that of the set points
  // at which there is one, and the amplitude is not used: percentiles miss a short stay.
  analysis::LoopMetrics settled;
  double pv_swing = 0.0;         // PV units, greatest minus least true PV
  double co_swing = 0.0;         // CO units, greatest minus least CO
  double whole_rms_error = 0.0;  // PV units, nothing left out: set-point moves as well
  // At the last set point the stem stood still and the integrator too, with an error left:
  // |mean (Ki e + w)| at most 2 % of |mean Ki e|.
  bool parked = false;
};

// Throws effects::EffectError for a model that can't be simulated.
TrialResult run_trial(const CalmTrial& trial);

}  // namespace loopwarden::studies
