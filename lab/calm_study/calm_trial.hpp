// SPDX-License-Identifier: Apache-2.0
// Runs a loop with or without the stickband jacket and measures the result.
//
// The set point of the model's scenario moves every `hold_s`. After each move `settling_s` is left
// out. The rest is measured for each set point and averaged over them. PV is the true flow in the
// pipe, without the transmitter's noise. The controller must have reverse action.
#pragma once

#include <cstdint>
#include <optional>

#include "model/analysis/loop_metrics.hpp"
#include "model/plant/loop_model.hpp"
#include "lab/calm_study/physical_plant.hpp"

namespace loopwarden::lab {

// Errors of the positioner's read-back.
struct ReadBackErrors {
  double bias = 0.0;        // CO units
  double noise = 0.0;       // CO units, standard deviation
  double resolution = 0.0;  // CO units
  double renewed_s = 0.0;   // s, time between two values: 1 to 1.5 times this; 0: each cycle
};

// A fault while the loop runs.
struct Trouble {
  enum class Kind : std::uint8_t {
    none,
    read_back_stuck,
    read_back_off,  // by 2 % of the output's span
    read_back_lost,
    read_back_late,  // by 5 s
    pv_frozen,       // for a minute, as the next two
    output_lost,
    reload,   // with kp reduced to nine tenths
    repaired  // the valve's effects are removed
  };
  Kind kind = Kind::none;
  double from_s = 0.0;
};

struct CalmTrial {
  plant::LoopModel model;  // controller.jacket: the form to try; scenario.duration_s is not used
  std::optional<PhysicalValve>
      physical{};  // replaces the model's valve, with air and process at 1 ms
  ReadBackErrors read_back;
  double output_resolution = 0.0;  // CO units, of the output converter
  Trouble trouble;
  double hold_s = 2700.0;      // s, time at each set point
  std::size_t unmeasured = 0;  // number of set points at the start that are not measured
  double settling_s = 900.0;   // s, left out after each move
};

struct TrialResult {
  // Means over the set points. rms_error is the root mean square, and the period is that of the set
  // points with a period. The amplitude is not used, because percentiles miss a short plateau.
  analysis::LoopMetrics settled;
  double pv_swing = 0.0;         // PV units, maximum minus minimum of the true PV
  double co_swing = 0.0;         // CO units, maximum minus minimum of CO
  double whole_rms_error = 0.0;  // PV units, of the whole run including set-point moves
  // At the last set point stem and integrator were at rest with a remaining error: |mean (Ki e +
  // w)| at most 2 % of |mean Ki e|.
  bool parked = false;
};

// Throws effects::EffectError for a model that can't be simulated.
TrialResult run_trial(const CalmTrial& trial);

}  // namespace loopwarden::lab
