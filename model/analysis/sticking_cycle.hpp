// SPDX-License-Identifier: Apache-2.0
// Identifies a sticking valve and its process together, from the record of a limit cycle.
// Equations and sources: docs/math/sticking-cycle.md.
//
// Errors: no exceptions; the result is empty if the record shows no such cycle.
// Limits: no integrating processes, no second lag, no gains below 0 (a valve that closes as CO
// rises). It reports no effect; `gap` does that with a separate search and proof.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "model/analysis/prediction_error.hpp"

namespace loopwarden::analysis {

struct StickingCycle {
  Estimate s, j;             // CO units
  Estimate gain;             // K
  Estimate time_constant_s;  // T
  Estimate dead_time_s;      // L
  double mean_co = 0.0;      // m
  double level = 0.0;        // c
  double noise_rms = 0.0;    // PV units, of e
  double rmse = 0.0;         // PV units, of the free run
  double fit_percent = 0.0;  // of the free run: 100 (1 - rmse / standard deviation of PV)
  double lead_nats = 0.0;
  std::size_t stem_reversals = 0;
  std::size_t every = 1;           // every n-th sample was used
  std::vector<double> free_run{};  // PV units, at the samples used
};

// Returns the valve and the process of the cycle. The columns have one length and no gaps.
std::optional<StickingCycle> find_sticking_cycle(std::span<const double> co,
                                                 std::span<const double> pv, double period_s);

}  // namespace loopwarden::analysis
