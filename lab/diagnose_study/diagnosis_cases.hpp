// SPDX-License-Identifier: Apache-2.0
// Simulated routine records on which `diagnose` is trained and measured: closed loops of many kinds with
// noise and loads, logged the way plants log. docs/diagnose.md lists what is drawn.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "model/diagnosis/classifier.hpp"
#include "lab/diagnose_study/ingredients.hpp"

namespace loopwarden::studies {

struct DiagnosisCase {
  diagnosis::Cause cause = diagnosis::Cause::none;  // what is wrong with the loop
  bool integrating = false;
  std::string kind;    // flow, pressure, level, temperature: by time scale and sampling
  std::string detail;  // law of the valve effect, shape of the disturbance
  std::string mover;   // what moves the loop: set point, load, oscillation, valve, tuning
  double size = 0.0;   // CO units: s of the stiction, deadband of the backlash
  std::vector<double> pv;
  std::vector<double> co;
  std::vector<double> sp;  // empty where it isn't logged
  double sample_time_s = 1.0;
};

// Case n of a seed is always the same. Draws again until the case shows what its cause says: a sticky
// valve slips, a tight loop swings.
DiagnosisCase diagnosis_case(std::uint64_t seed, std::size_t index,
                             const Ingredients& ingredients = all_ingredients());

}  // namespace loopwarden::studies
