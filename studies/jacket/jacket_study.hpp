// SPDX-License-Identifier: Apache-2.0
// What the forms of the stickband jacket do to loops: on the thesis's plant 1 over Ks, on random
// sticky loops, and on random healthy ones. docs/jacket.md explains the tables.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "model/control/stickband_jacket.hpp"
#include "studies/jacket/jacket_trial.hpp"

namespace loopwarden::studies {

// How the work is done; the results don't depend on it.
struct StudyWork {
  unsigned threads = 1;
  std::function<void(std::size_t done, std::size_t total)> progress;  // may be empty
};

// ---- The thesis's plant 1, with stiction of each law and several sizes.

struct Plant1Row {
  std::string law;  // choudhury, he, karnopp
  double s = 0.0;   // CO units
  double j = 0.0;   // CO units
  control::JacketForm form = control::JacketForm::off;
  double gain_per_s = 0.0;  // Ks; 0 where the form has none
  TrialResult result;
};

std::vector<Plant1Row> study_plant1(std::uint64_t seed, const StudyWork& work);

// What the paper says of Ks > 0, counted over the rows of one form against the same loop without
// jacket: smaller amplitude of PV, narrower stick band (swing of CO), higher frequency (turns of
// the stem per hour). Changes of more than 5 % count.
struct ClaimCount {
  std::size_t settings = 0;  // rows of this form
  std::size_t parked = 0;    // stands still off the set point
  std::size_t cycling = 0;   // not parked, and the stem turns
  std::size_t smaller = 0;   // of those cycling, as the next three
  std::size_t narrower = 0;
  std::size_t faster = 0;
  std::size_t all_three = 0;
  std::size_t rms_falls = 0;  // of all: RMS of SP - PV
};

ClaimCount count_claims(const std::vector<Plant1Row>& rows, control::JacketForm form);

// ---- Random loops. Case n of a seed is always the same loop.

struct RandomLoop {
  std::string law;       // of the friction; empty: a healthy valve
  JacketTrial chosen;    // on which the best Ks is chosen
  JacketTrial reported;  // same loop, other noise and other set points: what is reported
};

// `wandering`: an unmeasured load of 0.1 to 1.2 % of the PV span (standard deviation) that changes
// over minutes, so that the valve has to move.
enum class Load : std::uint8_t { steady, wandering };

RandomLoop random_sticky_loop(std::uint64_t seed, std::size_t index, Load load);

// How far the read-back of a healthy valve is off.
enum class ReadBackQuality : std::uint8_t { within_dead_zone, biased, noisy };
JacketTrial random_healthy_loop(std::uint64_t seed, std::size_t index, ReadBackQuality quality);

// One number of each case, in the order of the cases.
struct Spread {
  double tenth = 0.0;  // 10 % of the cases are below
  double median = 0.0;
  double ninetieth = 0.0;
  double worst = 0.0;  // the largest
};
Spread spread_of(const std::vector<double>& values);

struct StickyRow {
  std::string name;               // form and Ks
  double share_falls = 0.0;       // RMS of SP - PV below that without jacket, 0 to 1
  double share_falls_5 = 0.0;     // by more than 5 %
  double share_rises_5 = 0.0;     // above it by more than 5 %
  Spread rms_factor;              // RMS of SP - PV over that without jacket
  Spread whole_rms_factor;        // the same with set-point moves and settling
  double mean_error = 0.0;        // median |mean error| over the RMS without jacket
  double travel_factor = 0.0;     // median; stem travel over that without jacket
  double reversals_factor = 0.0;  // median
  double share_parked = 0.0;      // 0 to 1
  double gain_per_s = 0.0;        // Ks, its median where it is the best of each case
};

struct StickyStudy {
  Load load = Load::steady;
  double mean_error_off = 0.0;  // as StickyRow::mean_error, without jacket
  double share_parked_off = 0.0;
  std::vector<StickyRow> rows;
};

StickyStudy study_sticky_loops(std::size_t cases, std::uint64_t seed, Load load,
                               const StudyWork& work);

struct HealthyRow {
  ReadBackQuality quality = ReadBackQuality::within_dead_zone;
  control::JacketForm form = control::JacketForm::off;
  double share_rises = 0.0;  // cases whose settled RMS rises by more than 0.02 % of the PV span
  double worst_rise_percent = 0.0;  // of the PV span, settled RMS
  Spread whole_rms_factor;          // with set-point moves: is the loop slowed?
};

std::vector<HealthyRow> study_healthy_loops(std::size_t cases, std::uint64_t seed,
                                            const StudyWork& work);

}  // namespace loopwarden::studies
