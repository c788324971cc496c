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

// The healthy plant as identified by the engineers.
struct Plant {
  double gain;
  double time_constant_s;
  double dead_time_s;
  // Small lags that an identification counts as dead time.
  double second_lag_s;
  double actuator_lag_s;
  Stem stem;
};

Plant draw_plant(Random& random);

// As draw_plant(), with a friction in the range of healthy packings: 0.05 to 0.4 % of span.
Plant draw_common_plant(Random& random);

// A case under construction: the deviations from the healthy plant, and the resulting limits of
// tuning and set points.
struct Draft {
  Plant plant;
  double duration_s;

  // Valve, from the controller output on; without a stem the healthy one is used.
  Chain before_stem;
  std::unique_ptr<Element> stem;
  Chain after_stem;
  // Time at which the deviation begins, s; 0: from the start.
  double from_s = 0.0;
  // Part of the healthy valve, after its faulty parts.
  Chain characteristic;
  // Process; without a core the healthy lag is used.
  std::function<double(double)> gain_factor;
  double gain_factor_at_rest = 1.0;
  double extra_dead_time_s = 0.0;
  std::unique_ptr<Element> transport;
  std::unique_ptr<Element> core;
  Chain after_process;
  std::vector<std::function<double(double)>> added;
  // Top of the transmitter's range below the highest set point, relative; 0: the range covers it.
  double transmitter_short_of_top = 0.0;
  std::function<double(double)> line_lag_s;
  std::function<double(double)> meter;
  std::size_t reading_stands = 1;  // samples
  // Actual settings of the controller, relative to those that its engineers assume.
  double kp_factor = 1.0;
  double ki_factor = 1.0;

  // kp K L / tau; a larger value is faster.
  double tuning_low = 0.28;
  double tuning_high = 0.8;
  double integral_time_factor = 1.0;
  double most_loop_gain = std::numeric_limits<double>::infinity();
  double highest_travel = 8.5;
  bool constant_set_point = false;
  // Limits for a loop that operators leave in automatic. They are the share of the record with the
  // controller output at 0 or 10, and the RMS of SP - PV over the last third, PV units.
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
// Draws moves as operators make them: at least four in the first 20 minutes, then one every one to
// seven minutes; with `later_wide` these are over the whole range.
SetPointProfile draw_operated_profile(const Draft& draft, bool later_wide, Random& random);

}  // namespace loopwarden::hidden_cases
