// SPDX-License-Identifier: Apache-2.0
// A sticking valve and the process behind it, together, from the record of a limit cycle:
//
//   x = sticks(u; s, j)     T q' = K (x(t - L) - m) - q     y = c + q + n     n(k) - n(k-1) = e(k) - theta e(k-1)
//
//   u  CO, CO units     x  stem, CO units     y  PV, PV units     m  mean of CO     c  level, PV units
//   s, j  deadband + stickband and slip jump, CO units (effects/stiction/stiction_choudhury.hpp)
//   K  gain, PV units/CO unit     T  time constant, s     L  dead time, s
//   n  noise beside a load that wanders: theta 0 all wander, 1 all noise
//
// A straight valve sees nothing of the process in a closed loop whose SP stands: CO only follows PV. One that sticks
// turns CO into jumps of its own making, which no load could have made at these moments: the cycle is excitation enough.
// s, j, T and L are searched from a grid, theta with them, K is solved for; twice the log likelihood says by how much that
// beats the same without a band (s = 0, T free): `lead_nats`. It is a valve that sticks where the lead is clear and spread
// over the record, the stem turns often enough, and PV answers to it with a lag shorter than the cycle.
//
// A stem that comes to rest at once after each slip shows K j alone. Intervals hold what the profiles over j / s and over s
// leave open, and two standard deviations by a jackknife over twelve blocks of the record.
//
// Errors: none; nothing where the record shows no such cycle.
// What it can't do: integrating processes, a second lag, gains below 0 (a valve that closes as CO rises). It names no
// effect: `gap` does, by its own search and proof.
//
// Sources: Srinivasan, Rengaswamy, Narasimhan and Miller, Ind. Eng. Chem. Res. 44 (2005) 6719-6728 (Hammerstein model of
// a sticking valve); Jelali, J. Process Control 18 (2008) 632-642 (s and j by search, the process by least squares);
// Bacci di Capaci, Scali and Pannocchia, Ind. Eng. Chem. Res. 55 (2016) (with a load that wanders);
// Künsch, Ann. Stat. 17 (1989) 1217-1241 (jackknife over blocks).
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
  std::size_t stem_turns = 0;
  std::size_t every = 1;           // of the samples were looked at
  std::vector<double> free_run{};  // PV units, at these
};

// Columns of one length without gaps.
std::optional<StickingCycle> find_sticking_cycle(std::span<const double> co,
                                                 std::span<const double> pv, double period_s);

}  // namespace loopwarden::analysis
