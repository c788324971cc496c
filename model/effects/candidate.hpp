// SPDX-License-Identifier: Apache-2.0
// How `gap` looks for an effect in a record of CO and PV: what is searched, over which range and from
// where, what is solved for, and what the found values make. An effect that shows in several forms has
// a candidate for each; those of one name stand for one effect.
//
// Parameters that PV depends on linearly are solved for; the others are searched.
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "model/effects/effect_spec.hpp"

namespace loopwarden::effects {

// A searched parameter, as a number from 0 to 1 between `low` and `high`.
struct SearchRange {
  const char* name;
  double low;
  double high;
  bool logarithmic;
  int grid;                  // places to start from
  double first_step = 0.08;  // first move of the search, of the range from 0 to 1
  // A period: places are evenly spread in frequency, and the first move is part of a spectral line.
  bool is_period = false;

  double value(double position) const noexcept;
  double position(double value) const noexcept;
};

// Where a record leaves no room between the ends (a process as fast as the sampling), a little above
// the lower one.
SearchRange between(const char* name, double low, double high, bool logarithmic, int grid);

// By how much the stem rests below CO at the first sample, as a part of its resting band.
inline constexpr SearchRange kStart{"start", -1.0, 1.0, false, 1};

// What the ranges depend on.
struct SearchContext {
  double output_low = 0.0;       // CO units
  double output_high = 100.0;    // CO units
  double output_used_low = 0.0;  // CO units, where CO was in the record
  double output_used_high = 100.0;
  double pv_low = 0.0;  // PV units, where PV was in the record, without its noise
  double pv_high = 100.0;
  double period_s = 0.1;
  double duration_s = 300.0;     // s
  double time_constant_s = 1.0;  // s, of the process
  double dead_time_s = 0.0;      // s

  double span() const noexcept { return output_high - output_low; }         // CO units
  double slow_s() const noexcept { return time_constant_s + dead_time_s; }  // s
  double used_span() const noexcept {                                       // CO units
    return std::max(output_used_high - output_used_low, 0.02 * span());
  }
  double used_middle() const noexcept { return (output_used_low + output_used_high) / 2.0; }
};

// An actuator whose natural period (over 2 pi) is below this part of the process's time constant and
// dead time together, and below so many seconds, is a healthy valve's.
inline constexpr double kFastActuator = 0.07;
inline constexpr double kFastActuator_s = 0.3;

// Of a second order with more damping than that the overshoot is below 2 %: nobody sees it ring.
inline constexpr double kLeastRinging = 0.78;

struct Candidate {
  using Values = std::span<const double>;
  using Columns = std::vector<std::vector<double>>;
  using Deviations = std::map<std::string, double>;

  const char* name = "";
  Block block = Block::valve;
  bool smooth = true;                 // PV depends smoothly on the searched parameters
  int parameters = 0;                 // fitted ones, for the penalty
  double prior_nats = 0.0;            // by how much it is rarer than what explains as well
  std::vector<SearchRange> search{};  // kStart comes last where the stem rests beside CO
  std::size_t starts = 2;             // places of the grid from which it is refined
  // Of the parameter `more_by` (descriptor.hpp), in its units: below it the effect is the simpler one.
  double more_from = 0.0;
  std::vector<const char*> solved{};  // parameters of the effect that are solved for as they are

  // The effect from the values of `search` and what was solved; null: what effect() makes of their names.
  EffectSpec (*spec)(const Candidate& candidate, Values searched, Values solved) = nullptr;
  // How far from CO the stem can rest, CO units; null: nowhere but where CO puts it.
  double (*resting_half_band)(Values searched) = nullptr;
  // The same stem with the momentum of its actuator; null: none.
  EffectSpec (*with_momentum)(EffectSpec effect, double natural_frequency_rad_s,
                              double damping) = nullptr;
  // Share of the samples at which it does what no simpler effect does, under this CO; null: all.
  double (*telling)(Values searched, Values co, double period_s) = nullptr;
  // Standard deviations of named parameters from those of the searched and then the solved values
  // (`spread`); null: what is searched or in `solved` is what is named.
  void (*deviations)(Values searched, Values spread, const EffectSpec& spec,
                     Deviations& named) = nullptr;
  // PV's answer to each solved parameter, set to 1 before: `columns` of them.
  std::size_t columns = 0;
  void (*fill)(Values searched, double period_s, Columns& columns) = nullptr;  // null: stays 1

  // An effect at one place of the travel: whether this CO left the place and came back to it, on both sides. Where it did
  // not, the place can't be told from everywhere, and the effect is no more than an alternative. Null: it has no place.
  bool (*shows_place)(Values searched, Values co) = nullptr;

  bool friction = false;       // one valve has one of these
  bool slips = false;          // found by short runs, each from where the record stands
  bool solves_gain = false;    // the process gain's own column stands for it
  bool shifts_pv = false;      // moves PV as a whole: what sticks is searched for again beside it
  bool at_one_moment = false;  // shows at one place of the record: need not gain in all of it
  bool hides = false;          // of the transmitter: shows less than PV, not linear in it
  bool bends = false;          // of the transmitter: PV shows through a curve without memory
  bool wanders_on = false;     // where it is at the end of the fit says nothing of what follows
  bool is_level = false;       // a constant: without a measured CO nothing tells it from CO's level

  double output_low = 0.0;       // CO units
  double output_high = 100.0;    // CO units
  double time_constant_s = 1.0;  // s, of the process

  // The effect as a model file takes it.
  EffectSpec effect(Values searched, Values solved_values) const;
  std::size_t linear_columns() const noexcept { return columns; }
  bool starts_offset() const noexcept { return resting_half_band != nullptr; }
  // Stepped in the signal's path, not solved for.
  bool in_path() const noexcept { return columns == 0 && !solves_gain && !shown(); }
  bool shown() const noexcept { return hides || bends; }
};

}  // namespace loopwarden::effects
