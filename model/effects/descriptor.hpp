// SPDX-License-Identifier: Apache-2.0
// All that anyone asks of an effect: its name and number, keys with units and ranges, how to make it,
// how `gap` searches it, what it is to linear analysis and to alarms, how an engineer recognises it.
// Each effect has a folder: NAME_descriptor.cpp describes it, words.txt has its words. catalogue.hpp lists all.
#pragma once

#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "model/effects/candidate.hpp"
#include "model/effects/effect.hpp"
#include "model/effects/effect_spec.hpp"

namespace loopwarden::effects {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct ParameterInfo {
  const char* name;
  const char* unit;
  double low;         // least value
  bool low_is_open;   // `low` itself is not allowed
  double high;        // greatest value
  bool high_is_open;  // `high` itself is not allowed
  bool required;
  double fallback;  // value of an optional parameter that is not given
  const char* meaning;
  // Part of the law rather than what an engineer asks for: left out of sentences.
  bool of_the_law = false;
  // Where it is not given, the time constant of the process it stands in.
  bool as_process_lag = false;
};

struct OptionInfo {
  const char* name;
  std::vector<const char*> values;  // the first is the default
  const char* meaning;
};

// A table that an effect can't do without.
struct TableInfo {
  const char* form = "";     // as in a file: "[[t, factor], ...]"
  const char* meaning = "";  // with units
};

struct LookAlike {
  const char* name;  // another effect, or a cause that is none
  const char* tell;  // what tells them apart
};

struct Example {
  const char* file;  // of its picture, without the ending
  EffectSpec spec;
  Block block;
};

// What the effect is to a linear loop.
struct LinearPart {
  double gain = 1.0;
  double dead_time_s = 0.0;  // s
  std::vector<double> lags_s{};
};

// The valve's band that a describing function is of.
struct ValveBand {
  bool backlash = false;  // else stiction
  double s = 0.0;         // CO units
  double j = 0.0;         // CO units
};

struct EffectContext {
  double sample_time_s = 0.1;  // s
  double output_low = 0.0;     // CO units
  double output_high = 100.0;  // CO units
  double pv_low = 0.0;         // PV units, the transmitter's range
  double pv_high = 100.0;      // PV units
  std::uint64_t seed = 1;      // for effects with random numbers
  // s, of the process; 0: not known here
  double time_constant_s = 0.0;
  double dead_time_s = 0.0;  // s, of the process, for an effect that takes its place
};

// A parameter that is missing, unknown, or out of its range. `key` names it, empty for the effect
// as a whole.
class EffectError : public std::invalid_argument {
 public:
  EffectError(std::string key, const std::string& message)
      : std::invalid_argument(message), key_(std::move(key)) {}
  const std::string& key() const noexcept { return key_; }

 private:
  std::string key_;
};

class SpecReader;

struct Descriptor {
  int number = 0;  // in records and registers: never given to another effect
  const char* name = "";
  std::vector<Block> blocks{};  // where it may stand; the first is where it stands by default
  std::vector<ParameterInfo> parameters{};
  std::vector<OptionInfo> options{};
  bool takes_table =
      false;  // in files `curve` or `table` stands for its options, `table` where it has none
  TableInfo table{};
  bool is_learned = false;  // its table has the keys of its form, and a description goes with it
  const char* header = "";  // in model/plant: equation, source and limits

  // What no single key shows; throws EffectError. Null: nothing.
  void (*check)(const SpecReader& read, const EffectContext& context) = nullptr;
  // From a spec that was checked. Null: no effect of the plant, so no model holds it.
  Effect (*make)(const SpecReader& read, const EffectContext& context) = nullptr;

  bool takes_dead_time = false;  // stands in the place of the process's own

  // Appends its candidates. Null: `gap` can't find it.
  void (*candidates)(const SearchContext& context, std::vector<Candidate>& all) = nullptr;
  int valve_rank = 4;     // place in the valve: the actuator before the friction, the plug last
  bool is_noise = false;  // wanders by chance: no part of a free run
  // Two effects that belong together and are this one: `gap` names them as its alternative.
  std::vector<const char*> made_of{};
  // Where this parameter is 0 the effect is another one, in the catalogue or not; null: there is none.
  const char* more_by = nullptr;
  // How far from CO the stem can rest, CO units; null: nowhere but where CO puts it.
  double (*resting_band)(const SpecReader& read) = nullptr;
  // The law of a healthy valve's little friction and fast actuator; one effect has it, and where a
  // valve has that effect no other friction is allowed for.
  EffectSpec (*healthy_valve)(double friction, double natural_frequency_rad_s,
                              double damping) = nullptr;

  LinearPart (*linear)(const SpecReader& read) = nullptr;  // null: not in the linear loop
  ValveBand (*valve_band)(const SpecReader& read) = nullptr;

  std::vector<std::string_view> alarms{};  // that it agrees with, beside model_gap

  std::vector<Example> examples{};

  // From words.txt.
  const char* meaning = "";  // one line
  const char* remedy = "";   // what an engineer does about it, in plant words
  const char* seen = "";     // what an engineer sees
  std::vector<LookAlike> look_alikes{};
};

// Its `from` and `to` are parameters of its own: no schedule beside them.
bool has_own_times(const Descriptor& info) noexcept;
const ParameterInfo* find_parameter(const Descriptor& info, std::string_view name) noexcept;
const OptionInfo* find_option(const Descriptor& info, std::string_view name) noexcept;

// A spec with the defaults of its description. Both must outlive it.
class SpecReader {
 public:
  SpecReader(const Descriptor& info, const EffectSpec& spec) : info_(info), spec_(spec) {}

  // Throws std::logic_error for a parameter that the description does not have.
  double value(const char* name) const;
  bool has(const char* name) const { return spec_.parameters.contains(name); }
  std::string_view option(const char* name) const;
  const EffectSpec& spec() const noexcept { return spec_; }

 private:
  const Descriptor& info_;
  const EffectSpec& spec_;
};

// Throws EffectError: `key` must be as `rule` says, which stands before what was given.
[[noreturn]] void refuse(const SpecReader& read, const char* key, const std::string& rule);

// Of an effect whose option `curve` names a curve or says `table`: a table of 2 to `most` points that rise in both
// columns, and none beside a name. Throws EffectError.
void check_curve(const SpecReader& read, std::size_t most);

// As error messages give numbers.
std::string number_text(double value);

constexpr ParameterInfo at_least_zero(const char* name, const char* unit, const char* meaning) {
  return {name, unit, 0.0, false, kInfinity, true, true, 0.0, meaning};
}
constexpr ParameterInfo above_zero(const char* name, const char* unit, const char* meaning) {
  return {name, unit, 0.0, true, kInfinity, true, true, 0.0, meaning};
}
constexpr ParameterInfo any_value(const char* name, const char* unit, const char* meaning) {
  return {name, unit, -kInfinity, true, kInfinity, true, true, 0.0, meaning};
}
constexpr ParameterInfo optional(ParameterInfo info, double fallback) {
  info.required = false;
  info.fallback = fallback;
  return info;
}
constexpr ParameterInfo as_process_lag(ParameterInfo info) {
  info.as_process_lag = true;
  return info;
}
constexpr ParameterInfo of_the_law(ParameterInfo info) {
  info.of_the_law = true;
  return info;
}

}  // namespace loopwarden::effects
