// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "lab/hidden_cases/element.hpp"
#include "lab/hidden_cases/random.hpp"
#include "lab/hidden_cases/truth_loop.hpp"

namespace loopwarden::hidden_cases {

// The healthy plant that the engineers identified.
struct Plant {
  double gain;
  double time_constant_s;
  double dead_time_s;
  // Small parts that an identification counts as dead time.
  double second_lag_s;
  double actuator_lag_s;
  Stem stem;
};

Plant draw_plant(Random& random);

// As draw_plant(), with the friction of any healthy packing: 0.05 to 0.4 % of span.
Plant draw_common_plant(Random& random);

// What the effects leave behind: where the truth differs from the healthy plant, and what the
// tuning and the set points must then keep to.
struct Draft {
  Plant plant;
  double duration_s;

  // Valve, from the controller output on; an empty stem is the healthy one.
  Chain before_stem;
  std::unique_ptr<Element> stem;
  Chain after_stem;
  // From when on there is what differs from the healthy plant, s; 0: from the start.
  double from_s = 0.0;
  // A healthy valve's own, behind what is faulty in it.
  Chain characteristic;
  // Process; an empty core is the healthy lag.
  std::function<double(double)> gain_factor;
  double gain_factor_at_rest = 1.0;
  double extra_dead_time_s = 0.0;
  std::unique_ptr<Element> transport;
  std::unique_ptr<Element> core;
  Chain after_process;
  std::vector<std::function<double(double)>> added;
  // Relative to the highest set point; 0 for a transmitter that sees it all.
  double transmitter_short_of_top = 0.0;
  std::function<double(double)> line_lag_s;
  std::function<double(double)> meter;
  std::size_t reading_stands = 1;  // samples
  // What the controller has, relative to what its engineers believe.
  double kp_factor = 1.0;
  double ki_factor = 1.0;

  // kp K L / tau; the higher the faster.
  double tuning_low = 0.28;
  double tuning_high = 0.8;
  double integral_time_factor = 1.0;
  double most_loop_gain = std::numeric_limits<double>::infinity();
  double highest_travel = 8.5;
  bool constant_set_point = false;
  // Share of the record that the controller output may spend at 0 or 10, and the RMS of SP - PV
  // over the last third up to which people leave such a loop in automatic, PV units.
  double most_time_at_stops = 0.1;
  double most_tail_error = 1.0;

  std::map<std::string, double> parameters;
  std::string note;
};

// Adds an effect of the catalogue, a truth outside of it or a variant of "none" to the draft.
// Throws std::invalid_argument for an unknown name.
void apply_effect(std::string_view name, Draft& draft, Random& random);

Tuning draw_tuning(const Draft& draft, Random& random);
SetPointProfile draw_profile(const Draft& draft, Random& random);
// Moves as operators make them: four or more in the first 20 minutes, then one each minute to each seven; with `later_wide`
// then over the whole range.
SetPointProfile draw_operated_profile(const Draft& draft, bool later_wide, Random& random);

}  // namespace loopwarden::hidden_cases
