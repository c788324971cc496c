// SPDX-License-Identifier: Apache-2.0
#include "model/effects/catalogue.hpp"

#include <algorithm>
#include <cmath>

#include "model/effects/registered.hpp"
#include "model/numeric/text.hpp"

namespace loopwarden::effects {
namespace {

std::string range_text(const ParameterInfo& p) {
  std::string text;
  if (p.low > -kInfinity) text = (p.low_is_open ? "> " : ">= ") + number_text(p.low);
  if (p.high < kInfinity) {
    text += (text.empty() ? "" : " and ") + std::string(p.high_is_open ? "< " : "<= ") +
            number_text(p.high);
  }
  return text.empty() ? "a finite number" : text;
}

void check_parameter(const ParameterInfo& info, double value) {
  const bool low_ok = info.low_is_open ? value > info.low : value >= info.low;
  const bool high_ok = info.high_is_open ? value < info.high : value <= info.high;
  if (std::isfinite(value) && low_ok && high_ok) return;
  throw EffectError(info.name, std::string(info.name) + " must be " + range_text(info) + " " +
                                   info.unit + " (got " + number_text(value) + ")");
}

void check_option(const OptionInfo& option, const std::string& value) {
  if (std::find(option.values.begin(), option.values.end(), value) != option.values.end()) return;
  std::string allowed;
  for (const char* v : option.values) {
    if (!allowed.empty()) allowed += ", ";
    allowed += v;
  }
  throw EffectError(option.name, std::string(option.name)
                                     .append(" must be one of ")
                                     .append(allowed)
                                     .append(" (got '")
                                     .append(value)
                                     .append("')"));
}

// Returns all effects by number; those that models can't contain are last.
std::vector<Descriptor> in_order() {
  std::vector<Descriptor> all = registered_effects();
  std::sort(all.begin(), all.end(), [](const Descriptor& a, const Descriptor& b) {
    const bool a_word = a.make == nullptr;
    const bool b_word = b.make == nullptr;
    return a_word != b_word ? b_word : a.number < b.number;
  });
  return all;
}

const Descriptor* find(std::span<const Descriptor> among, std::string_view name) noexcept {
  for (const Descriptor& info : among) {
    if (info.name == name) return &info;
  }
  return nullptr;
}

}  // namespace

std::span<const Descriptor> vocabulary() noexcept {
  static const std::vector<Descriptor> all = in_order();
  return all;
}

std::span<const Descriptor> effect_catalogue() noexcept {
  static const std::size_t held = static_cast<std::size_t>(
      std::count_if(vocabulary().begin(), vocabulary().end(),
                    [](const Descriptor& info) { return info.make != nullptr; }));
  return vocabulary().first(held);
}

const Descriptor* find_effect(std::string_view name) noexcept {
  return find(effect_catalogue(), name);
}

const Descriptor* find_word(std::string_view name) noexcept { return find(vocabulary(), name); }

void check_effect(const EffectSpec& spec, Block block, const EffectContext& context) {
  const Descriptor* info = find_effect(spec.name);
  if (info == nullptr) throw EffectError("effect", "unknown effect '" + spec.name + "'");
  if (std::find(info->blocks.begin(), info->blocks.end(), block) == info->blocks.end()) {
    throw EffectError("effect", "effect '" + spec.name + "' belongs to the " +
                                    to_text(info->blocks.front()) + ", not to the " +
                                    to_text(block));
  }
  for (const auto& [name, value] : spec.parameters) {
    const ParameterInfo* parameter = find_parameter(*info, name);
    if (parameter == nullptr) {
      throw EffectError(name, "effect '" + spec.name + "' has no parameter '" + name + "'");
    }
    check_parameter(*parameter, value);
  }
  for (const auto& [name, value] : spec.options) {
    if (info->is_learned && name == "description") continue;
    const OptionInfo* option = find_option(*info, name);
    if (option == nullptr) {
      throw EffectError(name, "effect '" + spec.name + "' has no option '" + name + "'");
    }
    check_option(*option, value);
  }
  for (const ParameterInfo& parameter : info->parameters) {
    if (parameter.required && !spec.parameters.contains(parameter.name)) {
      throw EffectError("", "effect '" + spec.name + "' needs " + parameter.name + " (" +
                                parameter.unit + ": " + parameter.meaning + ")");
    }
  }
  if (info->check != nullptr) info->check(SpecReader(*info, spec), context);
  if (!info->takes_table && !info->is_learned && !spec.table.empty()) {
    throw EffectError("table", "effect '" + spec.name + "' takes no table");
  }
}

void check_curve(const SpecReader& read, std::size_t most) {
  const auto& table = read.spec().table;
  if (read.option("curve") != "table") {
    if (!table.empty()) {
      throw EffectError("table",
                        "a table can't be combined with a named curve; remove one of them");
    }
    return;
  }
  if (table.size() < 2 || table.size() > most) {
    throw EffectError("table", "table must have 2 to " + std::to_string(most) + " points (got " +
                                   std::to_string(table.size()) + ")");
  }
  for (std::size_t i = 0; i < table.size(); ++i) {
    const auto& [x, y] = table[i];
    if (!std::isfinite(x) || !std::isfinite(y)) {
      throw EffectError("table", "table holds a number that is not finite");
    }
    if (i > 0 && (x <= table[i - 1].first || y <= table[i - 1].second)) {
      throw EffectError(
          "table", "table must rise in both columns (see point " + std::to_string(i + 1) + ")");
    }
  }
}

bool takes_dead_time(const std::vector<EffectSpec>& specs) noexcept {
  return std::any_of(specs.begin(), specs.end(), [](const EffectSpec& spec) {
    const Descriptor* info = find_effect(spec.name);
    return info != nullptr && info->takes_dead_time;
  });
}

void complete(EffectSpec& spec, const EffectContext& context) {
  const Descriptor* info = find_effect(spec.name);
  if (info == nullptr || !(context.time_constant_s > 0.0)) return;
  for (const ParameterInfo& parameter : info->parameters) {
    if (!parameter.as_process_lag) continue;
    spec.parameters.emplace(parameter.name, context.time_constant_s);
  }
}

Effect make_effect(const EffectSpec& spec, const EffectContext& context) {
  const Descriptor* info = find_effect(spec.name);
  if (info == nullptr) throw EffectError("effect", "unknown effect '" + spec.name + "'");
  return info->make(SpecReader(*info, spec), context);
}

std::vector<Candidate> candidates(const SearchContext& context) {
  std::vector<Candidate> all;
  for (const Descriptor& info : effect_catalogue()) {
    const std::size_t first = all.size();
    if (info.candidates != nullptr) info.candidates(context, all);
    for (std::size_t i = first; i < all.size(); ++i) {
      all[i].name = info.name;
      all[i].output_low = context.output_low;
      all[i].output_high = context.output_high;
      all[i].time_constant_s = context.time_constant_s;
    }
  }
  return all;
}

bool agrees(const Descriptor& effect, std::string_view alarm) noexcept {
  return alarm == "model_gap" ||
         std::find(effect.alarms.begin(), effect.alarms.end(), alarm) != effect.alarms.end();
}

bool has_own_times(const Descriptor& info) noexcept {
  return find_parameter(info, "from") != nullptr;
}

const ParameterInfo* find_parameter(const Descriptor& info, std::string_view name) noexcept {
  for (const ParameterInfo& p : info.parameters) {
    if (p.name == name) return &p;
  }
  return nullptr;
}

const OptionInfo* find_option(const Descriptor& info, std::string_view name) noexcept {
  for (const OptionInfo& o : info.options) {
    if (o.name == name) return &o;
  }
  return nullptr;
}

double SpecReader::value(const char* name) const {
  const auto it = spec_.parameters.find(name);
  if (it != spec_.parameters.end()) return it->second;
  const ParameterInfo* parameter = find_parameter(info_, name);
  if (parameter == nullptr) throw std::logic_error(std::string("no parameter ") + name);
  return parameter->fallback;
}

std::string_view SpecReader::option(const char* name) const {
  const auto it = spec_.options.find(name);
  if (it != spec_.options.end()) return it->second;
  const OptionInfo* option = find_option(info_, name);
  if (option == nullptr) throw std::logic_error(std::string("no option ") + name);
  return option->values.front();
}

void refuse(const SpecReader& read, const char* key, const std::string& rule) {
  throw EffectError(
      key, std::string(key) + " must be " + rule + " (got " + number_text(read.value(key)) + ")");
}

std::string number_text(double value) { return numeric::text("%g", value); }

double SearchRange::value(double position) const noexcept {
  const double p = std::clamp(position, 0.0, 1.0);
  return logarithmic ? low * std::pow(high / low, p) : low + (high - low) * p;
}

double SearchRange::position(double value) const noexcept {
  const double v = std::clamp(value, low, high);
  return logarithmic ? std::log(v / low) / std::log(high / low) : (v - low) / (high - low);
}

EffectSpec Candidate::effect(Values searched, Values solved_values) const {
  if (spec != nullptr) return spec(*this, searched, solved_values);
  EffectSpec out{name};
  for (std::size_t i = 0; i < search.size(); ++i) {
    if (search[i].name != std::string_view(kStart.name))
      out.parameters[search[i].name] = searched[i];
  }
  for (std::size_t i = 0; i < std::min(solved.size(), solved_values.size()); ++i) {
    out.parameters[solved[i]] = solved_values[i];
  }
  return out;
}

SearchRange between(const char* name, double low, double high, bool logarithmic, int grid) {
  return {name, low, std::max(high, logarithmic ? 1.5 * low : low + 1e-6), logarithmic, grid};
}

}  // namespace loopwarden::effects
