// SPDX-License-Identifier: Apache-2.0
// Identifies a sticking valve and its process together, from the record of a limit cycle:
//
//   x = sticks(u; s, j)     T q' = K (x(t - L) - m) - q
//   y = c + q + n           n(k) - n(k-1) = e(k) - theta e(k-1)
//
//   u  CO, CO units     x  stem, CO units     y  PV, PV units
//   m  mean of CO       c  level, PV units
//   s, j  deadband + stickband and slip jump, CO units (effects/stiction/stiction_choudhury.hpp)
//   K  gain, PV units/CO unit     T  time constant, s     L  dead time, s
//   n  noise and a wandering disturbance: theta 0 is only the disturbance, 1 only noise
//
// With a linear valve, a closed loop with a constant SP has no information about the process,
// because CO only follows PV. A sticking valve changes CO into jumps that no disturbance could
// cause at these times, so the cycle excites the process sufficiently. s, j, T, L and theta are
// searched from a grid, and K is solved for. `lead_nats` is twice the log likelihood ratio to the
// same model without a band (s = 0, T free). The valve sticks if the lead is clear and spread over
// the record. In addition the stem must turn often enough, and the lag of PV after the stem must be
// shorter than the cycle.
//
// A stem that stops immediately after each slip shows only K j. The intervals include the profiles
// over j / s and over s, and two standard deviations by a jackknife over twelve blocks.
//
// Errors: no exceptions; the result is empty if the record shows no such cycle.
// Limits: no integrating processes, no second lag, no gains below 0 (a valve that closes as CO
// rises). It reports no effect; `gap` does that with a separate search and proof.
//
// Sources: Srinivasan, Rengaswamy, Narasimhan and Miller, Ind. Eng. Chem. Res. 44 (2005) 6719-6728
// (Hammerstein model of a sticking valve); Jelali, J. Process Control 18 (2008) 632-642 (s and j by
// search, the process by least squares); Bacci di Capaci, Scali and Pannocchia, Ind. Eng. Chem.
// Res. 55 (2016) (with a wandering disturbance); Künsch, Ann. Stat. 17 (1989) 1217-1241 (jackknife
// over blocks).
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
