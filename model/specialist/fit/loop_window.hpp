// SPDX-License-Identifier: Apache-2.0
// The length of a window, and a specialist's facts about a loop.
//
//   PV(s) / CO(s) = gain exp(-dead_time s) / (1 + time_constant s)
//
//   PV, CO         their units
//   gain           PV units / CO unit, not 0
//   dead_time      s, >= 0
//   time_constant  s, > 0
//
// No errors; the caller keeps the values within their ranges.
// Limits: no second lag, no integrating process, no gain that depends on the opening.
//
// Sources: the model that PI settings are commonly made from (model/analysis/tuning_rules.hpp);
// 961 samples, 31 x 31: Sewdass, thesis (Durban University of Technology), section 8.3.
#pragma once

#include <cstddef>

#include "model/plant/loop_model.hpp"

namespace loopwarden::specialist {

inline constexpr std::size_t kWindowSamples = 961;

// The healthy loop from CO to PV: gain, lag and dead time, and the spans that make both unitless.
struct LoopFacts {
  double period_s = 0.1;         // s
  double gain = 1.0;             // PV units / CO unit, not 0
  double time_constant_s = 1.0;  // s, > 0
  double dead_time_s = 0.0;      // s, >= 0
  double co_low = 0.0;           // CO units
  double co_high = 100.0;        // CO units, > co_low
  double pv_low = 0.0;           // PV units
  double pv_high = 100.0;        // PV units, > pv_low

  friend bool operator==(const LoopFacts&, const LoopFacts&) = default;
};

LoopFacts facts_of(const plant::LoopModel& model);

}  // namespace loopwarden::specialist
