// SPDX-License-Identifier: Apache-2.0
// The description of an effect: name, number, keys with units and ranges, law, and search by `gap`.
// It also has the part of the effect in linear analysis and alarms, and its signs for engineers.
// Each folder below this one describes one effect, with its texts in words.txt. catalogue.hpp
// collects all descriptions.
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

// A numeric key of an effect.
struct ParameterInfo {
  const char* name;
  const char* unit;
  double low;         // least value
  bool low_is_open;   // `low` itself is not allowed
  double high;        // greatest value
  bool high_is_open;  // `high` itself is not allowed
  bool required;
  double fallback;  // default of an optional parameter
  const char* meaning;
  // A constant of the law, of no interest to engineers: left out of sentences.
  bool of_the_law = false;
  // The default is the time constant of the process that has this effect.
  bool as_process_lag = false;
};

// A key of an effect with named values.
struct OptionInfo {
  const char* name;
  std::vector<const char*> values;  // the first is the default
  const char* meaning;
};

// A table that an effect requires.
struct TableInfo {
  const char* form = "";     // as in a file: "[[t, factor], ...]"
  const char* meaning = "";  // with units
};

// An effect or cause with similar signs.
struct LookAlike {
  const char* name;  // another effect, or a cause outside the vocabulary
  const char* tell;  // sign that distinguishes them
};

// An example that the guides show as a picture.
struct Example {
  const char* file;  // file name of the picture, without the extension
  EffectSpec spec;
  Block block;
};

// The effect as a part of a linear loop.
struct LinearPart {
  double gain = 1.0;
  double dead_time_s = 0.0;  // s
  std::vector<double> lags_s{};
};

// The band of the valve, for the describing function.
struct ValveBand {
  bool backlash = false;  // false: stiction
  double s = 0.0;         // CO units
  double j = 0.0;         // CO units
};

// The properties of the loop that checks and laws of effects use.
struct EffectContext {
  double sample_time_s = 0.1;  // s
  double output_low = 0.0;     // CO units
  double output_high = 100.0;  // CO units
  double pv_low = 0.0;         // PV units, range of the transmitter
  double pv_high = 100.0;      // PV units
  std::uint64_t seed = 1;      // for effects with random numbers
  // s, of the process; 0: unknown
  double time_constant_s = 0.0;
  double dead_time_s = 0.0;  // s, of the process, for an effect that replaces it
};

// Error for a parameter that is missing, unknown or out of range. `key` is its name, or empty if
// the error is about the whole effect.
class EffectError : public std::invalid_argument {
 public:
  EffectError(std::string key, const std::string& message)
      : std::invalid_argument(message), key_(std::move(key)) {}
  const std::string& key() const noexcept { return key_; }

 private:
  std::string key_;
};

class SpecReader;

// The description of one effect.
struct Descriptor {
  int number = 0;  // in records and registers: never reused for another effect
  const char* name = "";
  std::vector<Block> blocks{};  // allowed blocks; the first one is the default
  std::vector<ParameterInfo> parameters{};
  std::vector<OptionInfo> options{};
  bool takes_table =
      false;  // files use the key `curve` or `table` with options, and `table` without options
  TableInfo table{};
  bool is_learned = false;  // its table has keys that depend on the form, and a description
  const char* header = "";  // file in model/effects: equation, source and limits

  // Checks rules over several keys; throws EffectError. Null: it has no such rules.
  void (*check)(const SpecReader& read, const EffectContext& context) = nullptr;
  // Returns the law for a checked spec. Null: not an effect of the plant, so models don't contain
  // it.
  Effect (*make)(const SpecReader& read, const EffectContext& context) = nullptr;

  bool takes_dead_time = false;  // replaces the dead time of the process

  // Appends its candidates. Null: `gap` can't find it.
  void (*candidates)(const SearchContext& context, std::vector<Candidate>& all) = nullptr;
  int valve_rank = 4;     // place in the valve: the actuator before the friction, the plug last
  bool is_noise = false;  // random, so not part of a free run
  // Two effects that together look like this one: `gap` reports them as its alternative.
  std::vector<const char*> made_of{};
  // If this parameter is 0, the effect becomes another one, in the catalogue or not; null: no
  // parameter.
  const char* more_by = nullptr;
  // Returns the largest distance from CO at which the stem can rest, CO units; null: the stem rests
  // at CO.
  double (*resting_band)(const SpecReader& read) = nullptr;
  // Returns the effect for the small friction and the fast actuator of a healthy valve. Only one
  // effect has this function. If a valve has that effect, fits add no other friction.
  EffectSpec (*healthy_valve)(double friction, double natural_frequency_rad_s,
                              double damping) = nullptr;

  LinearPart (*linear)(const SpecReader& read) = nullptr;  // null: not in the linear loop
  ValveBand (*valve_band)(const SpecReader& read) = nullptr;

  std::vector<std::string_view> alarms{};  // alarms that it agrees with, in addition to model_gap

  std::vector<Example> examples{};

  // From words.txt.
  const char* meaning = "";  // one line
  const char* remedy = "";   // action of the engineer, in plant words
  const char* seen = "";     // signs in the plant
  std::vector<LookAlike> look_alikes{};
};

// Returns whether `from` and `to` are parameters of the effect. Such an effect has no schedule.
bool has_own_times(const Descriptor& info) noexcept;
const ParameterInfo* find_parameter(const Descriptor& info, std::string_view name) noexcept;
const OptionInfo* find_option(const Descriptor& info, std::string_view name) noexcept;

// Reads a spec, with the defaults of its description. Both must outlive the reader.
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

// Throws EffectError with the text "`key` must be `rule` (got the value)".
[[noreturn]] void refuse(const SpecReader& read, const char* key, const std::string& rule);

// Checks the table of an effect whose option `curve` is a named curve or `table`. With `table` it
// must have
// 2 to `most` points that rise in both columns; with a named curve it must be empty. Throws
// EffectError.
void check_curve(const SpecReader& read, std::size_t most);

// Returns the number as error messages show it.
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
