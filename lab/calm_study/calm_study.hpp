// SPDX-License-Identifier: Apache-2.0
// Tests all compensators on random loops with a sticking valve, and planned moves on healthy loops.
// lab/results/compensators.md explains the tables.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "model/numeric/random.hpp"
#include "lab/calm_study/calm_trial.hpp"

namespace loopwarden::lab {

// Settings of the execution, which don't affect the results.
struct StudyWork {
  unsigned threads = 1;
  std::function<void(std::size_t done, std::size_t total)> progress;  // may be empty
};

// ---- Random loops. Case n of a seed is always the same loop.

// `wandering`: an unmeasured load of 0.1 to 1.2 % of the PV span (standard deviation) that changes
// over minutes, so that the valve must move.
enum class Load : std::uint8_t { steady, wandering };
// Kind of valve: a law of model/plant, or friction, air and process at 1 ms (physical_plant.hpp).
enum class Valve : std::uint8_t { law, physical };

struct StickyLoop {
  std::string law;    // of the friction
  double s = 0.0;     // CO units
  double j = 0.0;     // CO units
  double load = 0.0;  // intensity, PV units / sqrt(s); 0: steady
  CalmTrial trial;    // without compensator
};
StickyLoop random_sticky_loop(std::uint64_t seed, std::size_t index, Load load,
                              Valve valve = Valve::law);
// Returns a loop whose positioner has a lag of up to 2 s and whose valve has no friction.
CalmTrial random_healthy_loop(std::uint64_t seed, std::size_t index);

// One compensator under test. Its function fits it to a loop, with errors drawn from `random`. If
// that returns false, the compensator is not offered and the loop runs with PI only.
struct Contestant {
  std::string name;
  std::function<bool(const StickyLoop& loop, numeric::Random& random, CalmTrial& trial)> fit;
  bool costly = false;  // runs only if selected: takes most of a minute per loop
};
std::vector<Contestant> contestants();

// Distribution of one value over all cases.
struct Spread {
  double tenth = 0.0;  // 10 % of the cases are smaller
  double median = 0.0;
  double ninetieth = 0.0;
  double worst = 0.0;  // the largest
};
Spread spread_of(const std::vector<double>& values);

struct StickyRow {
  std::string name;
  double share_falls = 0.0;       // RMS of SP - PV smaller than without compensator, 0 to 1
  double share_rises_5 = 0.0;     // larger by more than 5 %
  Spread rms_factor;              // RMS of SP - PV relative to that without compensator
  double whole_rms_factor = 0.0;  // median; the same including set-point moves and settling
  double travel_factor = 0.0;     // median; stem travel relative to that without compensator
  double share_travel = 0.0;      // stem travel larger than without compensator, 0 to 1
  double share_offered = 0.0;     // 0 to 1; all other values are of these cases
  std::vector<double> factors;    // of each case in which it is offered
};

struct StickyStudy {
  Load load = Load::steady;
  std::vector<StickyRow> rows;
};
// `only`: prefix of the compensators' names; empty: all.
StickyStudy study_sticky_loops(std::size_t cases, std::uint64_t seed, Load load,
                               const std::string& only, const StudyWork& work,
                               Valve valve = Valve::law);

// Results of planned_moves with a sticking valve, a wandering load and a fault.
struct TroubleRow {
  Trouble::Kind kind = Trouble::Kind::none;
  double share_worse =
      0.0;  // RMS afterwards exceeds that of PI with the same fault by 30 % and 0.02 % of span
  double worst = 0.0;  // factor relative to PI
};
const char* to_text(Trouble::Kind kind);
std::vector<TroubleRow> study_troubles(std::size_t cases, std::uint64_t seed,
                                       const StudyWork& work);

// Results of planned_moves with the limits of hardware (max_move 10 % of span, 60 moves per hour).
// The output has a rate limit, or the read-back is updated every few seconds.
struct RateRow {
  double percent_per_s = 0.0;  // of the output's span; infinity: no limit
  double read_back_s = 0.0;    // shortest time between two values of the read-back; 0: each cycle
  std::vector<double> factors{};  // of each loop: RMS of SP - PV relative to that of PI only
  std::vector<double> luck{};     // the same for PI only with another noise
};
// Each loop runs kRateRepeats times, each time with different noise and load. A factor uses the
// root mean square over these runs.
inline constexpr int kRateRepeats = 4;
std::vector<RateRow> study_rate_limits(std::size_t cases, std::uint64_t seed,
                                       const StudyWork& work);

struct HealthyStudy {
  double share_rises = 0.0;         // settled RMS rises by more than 0.02 % of the PV span
  double worst_rise_percent = 0.0;  // of the PV span
};
HealthyStudy study_healthy_loops(std::size_t cases, std::uint64_t seed, const StudyWork& work);

}  // namespace loopwarden::lab
