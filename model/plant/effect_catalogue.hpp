// SPDX-License-Identifier: Apache-2.0
// Every effect by name: where it acts, its parameters with units and ranges, and how to make one.
// Model files, generated documentation and the fits all go by this table.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "model/plant/effect.hpp"
#include "model/plant/loop_model.hpp"

namespace loopwarden::plant {

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
};

struct OptionInfo {
  const char* name;
  std::span<const char* const> values;  // the first is the default
  const char* meaning;
};

struct EffectInfo {
  const char* name;
  std::span<const Block> blocks;  // where it may stand; the first is where it stands by default
  std::span<const ParameterInfo> parameters;
  std::span<const OptionInfo> options;
  const char* header;   // file with equation, source and limits
  const char* meaning;  // one line
};

std::span<const EffectInfo> effect_catalogue() noexcept;
// Null if there is no such effect.
const EffectInfo* find_effect(std::string_view name) noexcept;

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

struct EffectContext {
  double sample_time_s = 0.1;  // s
  double output_low = 0.0;     // CO units
  double output_high = 100.0;  // CO units
  std::uint64_t seed = 1;      // for effects with random numbers
};

// Throws EffectError. Does all the checking there is, so that a spec that passes can be stepped.
void check_effect(const EffectSpec& spec, Block block, const EffectContext& context);
// `spec` must have passed check_effect() with the same context.
Effect make_effect(const EffectSpec& spec, const EffectContext& context);

}  // namespace loopwarden::plant
