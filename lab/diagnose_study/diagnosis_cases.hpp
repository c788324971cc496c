// SPDX-License-Identifier: Apache-2.0
// Simulated routine records for training and evaluation of `diagnose`: closed loops of many kinds
// with noise and disturbances, logged as in plants. loop_parts.hpp, loop_draw.hpp and
// ingredients.hpp have the distributions.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "model/diagnosis/classifier.hpp"
#include "lab/diagnose_study/ingredients.hpp"

namespace loopwarden::lab {

struct DiagnosisCase {
  diagnosis::Cause cause = diagnosis::Cause::none;  // fault of the loop
  bool integrating = false;
  std::string kind;    // flow, pressure, level, temperature: by time scale and sampling
  std::string detail;  // law of the valve effect, shape of the disturbance
  std::string mover;   // cause of movement: set point, load, oscillation, valve, tuning
  double size = 0.0;   // CO units: s of the stiction, deadband of the backlash
  std::vector<double> pv;
  std::vector<double> co;
  std::vector<double> sp;  // empty if not logged
  double sample_time_s = 1.0;
};

// Returns a case; case n of a seed is always the same. It draws again until the case shows its
// cause: a sticky valve slips, a tight loop oscillates.
DiagnosisCase diagnosis_case(std::uint64_t seed, std::size_t index,
                             const Ingredients& ingredients = all_ingredients());

}  // namespace loopwarden::lab
