// SPDX-License-Identifier: Apache-2.0
// What every compensator does to random loops with a sticking valve, and planned moves to healthy ones.
// docs/compensators.md explains the tables.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "model/numeric/random.hpp"
#include "lab/calm_study/calm_trial.hpp"

namespace loopwarden::studies {

// How the work is done; the results don't depend on it.
struct StudyWork {
  unsigned threads = 1;
  std::function<void(std::size_t done, std::size_t total)> progress;  // may be empty
};

// ---- Random loops. Case n of a seed is always the same loop.

// `wandering`: an unmeasured load of 0.1 to 1.2 % of the PV span (standard deviation) that changes
// over minutes, so that the valve has to move.
enum class Load : std::uint8_t { steady, wandering };
// What the valve is: a law of model/plant, or friction, air and process at 1 ms (physical_plant.hpp).
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
// A positioner with a lag of up to 2 s in place of the friction.
CalmTrial random_healthy_loop(std::uint64_t seed, std::size_t index);

// One compensator, fitted to a loop; `random` for what it is told wrong. False: it is not offered, and PI goes on.
struct Contestant {
  std::string name;
  std::function<bool(const StickyLoop& loop, numeric::Random& random, CalmTrial& trial)> fit;
  bool costly = false;  // takes part only where it is asked for: most of a minute a loop
};
std::vector<Contestant> contestants();

// One number of each case, in the order of the cases.
struct Spread {
  double tenth = 0.0;  // 10 % of the cases are below
  double median = 0.0;
  double ninetieth = 0.0;
  double worst = 0.0;  // the largest
};
Spread spread_of(const std::vector<double>& values);

struct StickyRow {
  std::string name;
  double share_falls = 0.0;       // RMS of SP - PV below that without compensator, 0 to 1
  double share_rises_5 = 0.0;     // above it by more than 5 %
  Spread rms_factor;              // RMS of SP - PV over that without
  double whole_rms_factor = 0.0;  // median; the same with set-point moves and settling
  double travel_factor = 0.0;     // median; stem travel over that without
  double share_travel = 0.0;      // stem travel above that without, 0 to 1
  double share_offered = 0.0;     // 0 to 1; all else is of these
  std::vector<double> factors;    // of each case that it is offered
};

struct StickyStudy {
  Load load = Load::steady;
  std::vector<StickyRow> rows;
};
// `only`: contestants whose name begins so; empty: all.
StickyStudy study_sticky_loops(std::size_t cases, std::uint64_t seed, Load load,
                               const std::string& only, const StudyWork& work,
                               Valve valve = Valve::law);

// planned_moves in loops with a sticking valve and a wandering load when something goes wrong.
struct TroubleRow {
  Trouble::Kind kind = Trouble::Kind::none;
  double share_worse =
      0.0;  // RMS afterwards above PI's under the same trouble by 30 % and 0.02 % of span
  double worst = 0.0;  // factor on PI's
};
const char* to_text(Trouble::Kind kind);
std::vector<TroubleRow> study_troubles(std::size_t cases, std::uint64_t seed,
                                       const StudyWork& work);

// planned_moves as on hardware (max_move 10 % of span, 60 moves per hour) behind an output with a
// rate limit, or with a
// read-back that is renewed every few seconds.
struct RateRow {
  double percent_per_s = 0.0;     // of the output's span; infinity: none
  double read_back_s = 0.0;       // least time between two values of the read-back; 0: each cycle
  std::vector<double> factors{};  // of each loop: RMS of SP - PV over that of PI only
  std::vector<double> luck{};     // the same of PI only with another noise
};
// Each loop runs kRateRepeats times with its own noise and load; a factor is of the root mean
// square over these runs.
inline constexpr int kRateRepeats = 4;
std::vector<RateRow> study_rate_limits(std::size_t cases, std::uint64_t seed,
                                       const StudyWork& work);

struct HealthyStudy {
  double share_rises = 0.0;         // settled RMS rises by more than 0.02 % of the PV span
  double worst_rise_percent = 0.0;  // of the PV span
};
HealthyStudy study_healthy_loops(std::size_t cases, std::uint64_t seed, const StudyWork& work);

}  // namespace loopwarden::studies
