// SPDX-License-Identifier: Apache-2.0
// One run of a loop with or without the stickband jacket, measured.
//
// The set point of the model's scenario moves every `hold_s`. After each move `settling_s` is left
// out; what follows is measured for each set point and averaged over them. PV is the true one,
// before the transmitter's noise: what flows in the pipe. The controller must be in reverse action.
#pragma once

#include <cstdint>
#include <optional>

#include "model/analysis/loop_metrics.hpp"
#include "model/plant/loop_model.hpp"
#include "lab/calm_study/physical_plant.hpp"

namespace loopwarden::studies {

// Errors of the positioner's read-back.
struct ReadBackErrors {
  double bias = 0.0;        // CO units
  double noise = 0.0;       // CO units, standard deviation
  double resolution = 0.0;  // CO units
  double renewed_s =
      0.0;  // s, from one value to the next: between this and 1.5 times as long; 0: each cycle
};

// What goes wrong while the loop runs.
struct Trouble {
  enum class Kind : std::uint8_t {
    none,
    read_back_stuck,
    read_back_off,  // by 2 % of the output's span
    read_back_lost,
    read_back_late,  // by 5 s
    pv_frozen,       // for a minute, and so the next two
    output_lost,
    reload,   // with nine tenths of kp
    repaired  // the valve's effects are gone
  };
  Kind kind = Kind::none;
  double from_s = 0.0;
};

struct CalmTrial {
  plant::LoopModel model;  // controller.jacket: the form to try; scenario.duration_s is not used
  std::optional<PhysicalValve>
      physical{};  // in the place of the model's valve, with air and process at 1 ms
  ReadBackErrors read_back;
  double output_resolution = 0.0;  // CO units, of the converter that CO goes through
  Trouble trouble;
  double hold_s = 2700.0;      // s, time at each set point
  std::size_t unmeasured = 0;  // set points in the beginning that are not measured
  double settling_s = 900.0;   // s, left out of it
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
