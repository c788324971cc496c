// SPDX-License-Identifier: Apache-2.0
// What the specialists and the alarms would see on this loop: its twin is run with each fault of
// each size, with its own noise, load and set-point moves, through the very monitor of the daemon.
//
//   smallest size   the least of a grid from 0.5 to 20 % of span at which kFound of the windows that hold a move of SP
//                   show a valve fault, of whatever kind: the probabilities of all faults together
//                   reach kFault
//   low air supply  the same of what the stem lacked of its place, % of span: in windows that lack so much or more
//   time to alarm   at that size, median over runs of two hours of the time until the fault's own alarm comes (of
//                   backlash and hysteresis either), hours
//   false alarms    a year: upper end of the 95 % interval of a Poisson rate, from the alarms of healthy hours
//
// Errors: effects::EffectError for a twin that can't be stepped. Of an integrating process nothing:
// the specialists know none.
// What it can't do: faults that the twin's own moves never touch; a plant that changes in other
// ways than the twin may.
//
// Source: Garwood, Biometrika 28 (1936) 437-442 (interval of a Poisson rate).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>

#include "model/plant/loop_model.hpp"
#include "model/specialist/judge/limits.hpp"
#include "model/specialist/judge/team.hpp"
#include "model/specialist/train/team_training.hpp"

namespace loopwarden::twin {

inline constexpr double kFound = 0.95;
inline constexpr std::array kWatched{
    specialist::Condition::stiction, specialist::Condition::backlash,
    specialist::Condition::hysteresis, specialist::Condition::low_air_supply};

struct DetectabilitySettings {
  std::uint64_t seed = 1;
  std::size_t windows = 60;       // of each size
  std::size_t alarm_runs = 5;     // of two hours each
  std::size_t healthy_runs = 24;  // of two hours each
};

struct Seen {
  specialist::Condition condition = specialist::Condition::stiction;
  std::optional<double> percent_of_span;  // none: no size of the grid
  std::optional<double> hours_to_alarm;   // none: no alarm in most of the runs
  double found_at_most = 0.0;             // share of the windows that show it, at the best size
};

struct Detectability {
  std::array<Seen, kWatched.size()> seen{};
  std::size_t false_alarms = 0;
  double false_alarms_per_year = 0.0;  // upper end
  double simulated_years = 0.0;
};

Detectability look(const plant::LoopModel& twin, const specialist::Team& team,
                   const DetectabilitySettings& settings, const specialist::ParallelFor& parallel,
                   const std::function<void(double)>& progress);

}  // namespace loopwarden::twin
