// SPDX-License-Identifier: Apache-2.0
// A candidate describes how `gap` searches for one effect in a record of CO and PV: the searched
// parameters with their ranges and starts, the solved parameters, and the effect that the found
// values make. An effect with several forms has one candidate per form, all with the effect's name.
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

// A searched parameter. The search uses its position, a number from 0 at `low` to 1 at `high`.
struct SearchRange {
  const char* name;
  double low;
  double high;
  bool logarithmic;
  int grid;                  // number of start positions
  double first_step = 0.08;  // first move of the search, share of the range from 0 to 1
  // The parameter is a period: starts are evenly spread in frequency, and the first move is part of
  // a spectral line.
  bool is_period = false;

  double value(double position) const noexcept;
  double position(double value) const noexcept;
};

// Returns a range from `low` to `high`. If `high` is not above `low` (a process as fast as the
// sampling), the range ends a little above `low`.
SearchRange between(const char* name, double low, double high, bool logarithmic, int grid);

// Distance by which the stem rests below CO at the first sample, as a share of its resting band.
inline constexpr SearchRange kStart{"start", -1.0, 1.0, false, 1};

// The properties of the record and of the loop that the search ranges depend on.
struct SearchContext {
  double output_low = 0.0;       // CO units
  double output_high = 100.0;    // CO units
  double output_used_low = 0.0;  // CO units, range of CO in the record
  double output_used_high = 100.0;
  double pv_low = 0.0;  // PV units, range of PV in the record, without its noise
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

// An actuator is that of a healthy valve if its natural period (over 2 pi) is below both limits:
// this share of the sum of the process's time constant and dead time, and this many seconds.
inline constexpr double kFastActuator = 0.07;
inline constexpr double kFastActuator_s = 0.3;

// A second order with more damping overshoots by less than 2 %, which users don't notice as
// ringing.
inline constexpr double kLeastRinging = 0.78;

struct Candidate {
  using Values = std::span<const double>;
  using Columns = std::vector<std::vector<double>>;
  using Deviations = std::map<std::string, double>;

  const char* name = "";
  Block block = Block::valve;
  bool smooth = true;                 // PV depends smoothly on the searched parameters
  int parameters = 0;                 // number of fitted parameters, for the penalty
  double prior_nats = 0.0;            // handicap against more common effects that fit as well
  std::vector<SearchRange> search{};  // kStart is the last one if the stem can rest away from CO
  std::size_t starts = 2;             // number of grid points from which the search is refined
  // Least value of the parameter `more_by` (descriptor.hpp), in its units. Below it the record
  // shows the simpler effect.
  double more_from = 0.0;
  std::vector<const char*> solved{};  // parameters of the effect that are solved for directly

  // Returns the effect from the searched and solved values; null: effect() uses the names of the
  // values.
  EffectSpec (*spec)(const Candidate& candidate, Values searched, Values solved) = nullptr;
  // Returns the largest distance from CO at which the stem can rest, CO units; null: the stem rests
  // at CO.
  double (*resting_half_band)(Values searched) = nullptr;
  // Returns the same effect with the momentum of the actuator; null: the effect has no such form.
  EffectSpec (*with_momentum)(EffectSpec effect, double natural_frequency_rad_s,
                              double damping) = nullptr;
  // Returns the share of the samples at which this CO makes the effect differ from every simpler
  // effect; null: all samples.
  double (*telling)(Values searched, Values co, double period_s) = nullptr;
  // Fills in the standard deviations of named parameters from `spread`, the deviations of the
  // searched and then the solved values; null: every parameter is searched or in `solved`, so
  // `spread` applies directly.
  void (*deviations)(Values searched, Values spread, const EffectSpec& spec,
                     Deviations& named) = nullptr;
  // Number of solved parameters with a response in PV.
  std::size_t columns = 0;
  // Fills the response of PV to each of them; the columns are 1 before. Null: they stay 1.
  void (*fill)(Values searched, double period_s, Columns& columns) = nullptr;

  // For an effect at one place of the travel: returns whether this CO left the place and returned
  // to it on both sides. If not, the record can't distinguish the place from the whole travel, and
  // the effect is reported only as an alternative. Null: the effect has no place.
  bool (*shows_place)(Values searched, Values co) = nullptr;

  bool friction = false;       // friction of the valve: a valve has at most one of these effects
  bool slips = false;          // found by short runs, each from the state of the record
  bool solves_gain = false;    // solved with the column of the process gain
  bool shifts_pv = false;      // shifts all of PV: friction is searched again together with it
  bool at_one_moment = false;  // visible at one moment: it need not improve the whole record
  bool hides = false;          // of the transmitter: hides part of PV, not linear in it
  bool bends = false;          // of the transmitter: bends PV by a curve without memory
  bool wanders_on = false;     // its state at the end of the fit doesn't predict later samples
  bool is_level = false;       // a constant: without a measured CO it equals a shift of CO

  double output_low = 0.0;       // CO units
  double output_high = 100.0;    // CO units
  double time_constant_s = 1.0;  // s, of the process

  // Returns the effect in the form of a model file.
  EffectSpec effect(Values searched, Values solved_values) const;
  std::size_t linear_columns() const noexcept { return columns; }
  bool starts_offset() const noexcept { return resting_half_band != nullptr; }
  // Returns whether the effect is stepped in the signal path, not solved for.
  bool in_path() const noexcept { return columns == 0 && !solves_gain && !shown(); }
  bool shown() const noexcept { return hides || bends; }
};

}  // namespace loopwarden::effects
