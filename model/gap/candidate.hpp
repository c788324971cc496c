// SPDX-License-Identifier: Apache-2.0
// The competitors: every effect of the catalogue that a record of CO and PV can show, with what is to
// be fitted. Parameters that PV depends on linearly are solved for; the others are searched.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "model/plant/loop_model.hpp"

namespace loopwarden::gap {

enum class Kind : std::uint8_t {
  stiction,
  backlash,
  hysteresis_width,
  hysteresis_offset,
  low_air_supply,
  equal_percentage,
  quick_opening,
  butterfly,
  curve_table,
  cam_obstruction,
  positioner_overshoot,
  gain_change,
  extra_dead_time,
  extra_lag,
  output_bias,
  drift,
  oscillating_disturbance,
  step_disturbance,
};

// An actuator whose natural period (over 2 pi) is below this part of the process's time constant and
// dead time together, and below so many seconds, is a healthy valve's.
inline constexpr double kFastActuator = 0.07;
inline constexpr double kFastActuator_s = 0.3;

// A searched parameter, as a number from 0 to 1 between `low` and `high`.
struct SearchRange {
  const char* name;
  double low;
  double high;
  bool logarithmic;
  int grid;  // places to start from

  double value(double position) const noexcept;
  double position(double value) const noexcept;
};

// What the ranges depend on.
struct SearchContext {
  double output_low = 0.0;       // CO units
  double output_high = 100.0;    // CO units
  double output_used_low = 0.0;  // CO units, where CO was in the record
  double output_used_high = 100.0;
  double period_s = 0.1;
  double duration_s = 300.0;     // s
  double time_constant_s = 1.0;  // s, of the process
  double dead_time_s = 0.0;      // s
};

struct Candidate {
  Kind kind;
  const char* name;  // in the catalogue
  plant::Block block;
  bool smooth;                      // PV depends smoothly on the searched parameters
  int parameters;                   // fitted ones, for the penalty
  std::vector<SearchRange> search;  // an offset of the stem at the start comes last where it sticks
  bool starts_offset = false;
  std::size_t starts = 2;      // places of the grid from which it is refined
  double output_low = 0.0;     // CO units
  double output_high = 100.0;  // CO units

  std::size_t linear_columns() const noexcept;
};

// Those whose `name` is unique stand for one effect; hysteresis and the characteristics have several.
std::vector<Candidate> candidates(const SearchContext& context);

// The searched effects of the valve and of the process as the catalogue takes them. `values` are those
// of Candidate::search.
plant::EffectSpec searched_spec(const Candidate& candidate, std::span<const double> values);
// The whole effect, with the solved parameters.
plant::EffectSpec complete_spec(const Candidate& candidate, std::span<const double> values,
                                std::span<const double> solved);

// One valve has one of these.
bool is_friction(Kind kind) noexcept;

// Place in the valve's chain: the actuator before the friction, the plug last.
int valve_rank(std::string_view effect) noexcept;

}  // namespace loopwarden::gap
