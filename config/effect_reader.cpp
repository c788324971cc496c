// SPDX-License-Identifier: Apache-2.0
#include "config/effect_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace loopwarden::config {
namespace {

using effects::Block;
using effects::Descriptor;
using effects::EffectSpec;

constexpr auto kBlocks = std::to_array<Choice<Block>>({{"valve", Block::valve},
                                                       {"process", Block::process},
                                                       {"transmitter", Block::transmitter},
                                                       {"disturbance", Block::disturbance}});

Interval interval(const effects::ParameterInfo& parameter) {
  return {parameter.low, parameter.high, parameter.low_is_open, parameter.high_is_open};
}

bool may_stand_in(const Descriptor& info, Block block) {
  return std::find(info.blocks.begin(), info.blocks.end(), block) != info.blocks.end();
}

// Returns the named effect; null if the name is missing, unknown or not allowed in `block`.
const Descriptor* read_name(MapReader& in, std::optional<Block> block) {
  const Value<std::string> name = in.need_text("effect", "name, see the table of effects");
  if (in.describing()) return nullptr;
  const Descriptor* info = name.valid ? effects::find_effect(name.value) : nullptr;
  if (info == nullptr) {
    in.ignore_rest();
    if (!name.valid) return nullptr;
    std::vector<std::string> names;
    for (const Descriptor& known : effects::effect_catalogue()) names.emplace_back(known.name);
    in.error("effect", fmt::format("unknown effect '{}'{}", quotable(name.value),
                                   suggestion(name.value, names)));
    return nullptr;
  }
  if (block && !may_stand_in(*info, *block)) {
    in.error("effect", fmt::format("'{}' belongs to the {}, not to the {}", info->name,
                                   to_text(info->blocks.front()), to_text(*block)));
  }
  return info;
}

// Reads `curve: butterfly`, `curve: {name: equal_percentage, rangeability: 30}` or `table: [[x, q],
// ...]`.
void read_curve(MapReader& in, const Descriptor& info, EffectSpec& spec) {
  const char* meaning = info.options.front().meaning;
  std::vector<std::string> names;
  for (const char* name : info.options.front().values) {
    if (std::string_view(name) != "table") names.emplace_back(name);
  }
  in.declare("curve", "name or mapping", Presence::optional, "", meaning);
  const Value<std::vector<std::pair<double, double>>> table =
      in.maybe_points("table", info.table.form, info.table.meaning);
  if (table.given && in.given("curve")) {
    in.error("table", fmt::format("conflicts with curve (at {}); give one of them",
                                  to_text(in.place("curve"))));
    return;
  }
  if (table.given) {
    spec.options["curve"] = "table";
    spec.table = table;
    return;
  }
  if (!in.given("curve")) {
    in.error("needs a curve or a table");
  } else if (in.kind("curve") == YamlNode::Kind::map) {
    if (std::optional<MapReader> curve = in.maybe_section("curve", meaning)) {
      spec.options["curve"] = curve->need_word("name", names, "of the curve").value;
      const effects::ParameterInfo& own = info.parameters.front();
      const Value<double> value =
          curve->maybe_number(own.name, {.range = interval(own), .meaning = own.meaning});
      if (value.given) spec.parameters[own.name] = value;
    }
  } else {
    spec.options["curve"] = in.need_word("curve", names, meaning).value;
  }
}

void read_parameters(MapReader& in, const Descriptor& info, EffectSpec& spec) {
  for (const effects::ParameterInfo& parameter : info.parameters) {
    const NumberRule rule{parameter.unit, interval(parameter), parameter.meaning};
    const Value<double> value = parameter.required ? in.need_number(parameter.name, rule)
                                                   : in.maybe_number(parameter.name, rule);
    if (value.given) spec.parameters[parameter.name] = value;
  }
  for (const effects::OptionInfo& option : info.options) {
    const std::vector<std::string> names(option.values.begin(), option.values.end());
    const Value<std::string> value = in.word_of(option.name, names, option.meaning);
    if (value.given) spec.options[option.name] = value;
  }
}

// Checks the keys against each other, with the check of the catalogue.
void check(MapReader& in, const EffectSpec& spec, Block block,
           const effects::EffectContext& context) {
  try {
    effects::check_effect(spec, block, context);
  } catch (const effects::EffectError& fault) {
    if (fault.key().empty()) {
      in.error(fault.what());
    } else {
      in.error(fault.key(), fault.what());
    }
  }
}

void read_table(MapReader& in, const Descriptor& info, EffectSpec& spec) {
  const Value<std::vector<std::pair<double, double>>> table =
      in.maybe_points("table", info.table.form, info.table.meaning);
  if (table.given) {
    spec.table = table;
  } else {
    in.error(fmt::format("needs a table: {}, {}", info.table.form, info.table.meaning));
  }
}

// Reads two lists of equal length.
void read_columns(MapReader& in, EffectSpec& spec, const char* first, const char* second,
                  const char* unit, const char* meaning_first, const char* meaning_second) {
  const Value<std::vector<double>> a = in.maybe_numbers(first, unit, meaning_first);
  const Value<std::vector<double>> b = in.maybe_numbers(second, "", meaning_second);
  if (in.describing()) return;
  if (!a.given || !b.given) {
    in.error(fmt::format("needs {} and {}", first, second));
    return;
  }
  if (a.value.size() > b.value.size() ||
      (a.value.size() < b.value.size() && std::string_view(first) == "thresholds")) {
    in.error(first, fmt::format("must have as many entries as {} ({}, got {})", second,
                                b.value.size(), a.value.size()));
    return;
  }
  for (std::size_t i = 0; i < b.value.size(); ++i) {
    spec.table.emplace_back(i < a.value.size() ? a.value[i] : 0.0, b.value[i]);
  }
}

// Reads a learned effect by its form: a table, thresholds and weights, or a transfer function.
void read_learned(MapReader& in, EffectSpec& spec) {
  const bool all = in.describing();
  const std::string form = spec.options.contains("form") ? spec.options.at("form") : "static";
  if (all || form == "hysteretic") {
    read_columns(in, spec, "thresholds", "weights", "CO units",
                 "of hysteretic: half widths of plays", "of hysteretic: one for each threshold");
  }
  if (all || form == "dynamic") {
    read_columns(in, spec, "numerator", "denominator", "", "of dynamic: by rising powers of p, s",
                 "of dynamic: by rising powers of p, s");
  }
  if (all || form == "static" || form == "gain_profile") {
    const Value<std::vector<std::pair<double, double>>> table =
        in.maybe_points("table", "[[in, out], ...]",
                        "of static: flow asked for and flow, CO units; of gain_profile: opening or "
                        "time and factor");
    if (table.given) {
      spec.table = table;
    } else if (!all) {
      in.error("needs a table: [[in, out], ...]");
    }
  }
  const Value<std::string> description = in.text("description", "description for engineers", "");
  if (description.given) spec.options["description"] = description;
}

EffectSpec read_effect(MapReader& in, const Descriptor& info,
                       const effects::EffectContext& context) {
  EffectSpec spec;
  spec.name = info.name;
  if (info.takes_table && !info.options.empty()) {
    read_curve(in, info, spec);
  } else {
    read_parameters(in, info, spec);
    if (info.takes_table) read_table(in, info, spec);
    if (info.is_learned) read_learned(in, spec);
  }
  effects::complete(spec, context);
  return spec;
}

void read_schedule(MapReader& in, effects::Schedule& schedule) {
  const Value<double> from =
      in.maybe_number("from", {"s", any_number(), "when it begins", "always there"});
  const Value<double> to = in.maybe_number("to", {"s", any_number(), "when it ends", "never"});
  schedule.ramp_s =
      in.number("ramp", {"s", at_least(0.0), "time in which it grows to its full size"}, 0.0);
  if (from.given) schedule.from_s = from;
  if (to.given) schedule.to_s = to;
  if (from.given && to.given && from.valid && to.valid && to <= from) {
    in.error("to", fmt::format("must be after from = {} s (at {}) (got {})", brief(from),
                               to_text(from.place), brief(to)));
  }
  if (schedule.ramp_s > 0.0 && !from.given) {
    in.error("ramp", "needs from, the time at which the effect begins to grow");
  }
}

plant::ScheduledFault read_fault(MapReader& in, const effects::EffectContext& context) {
  plant::ScheduledFault fault;
  const std::size_t errors_before = in.report().error_count();
  const Descriptor* info = read_name(in, std::nullopt);
  if (info != nullptr) fault.effect = read_effect(in, *info, context);
  const Block usual_block = info != nullptr ? info->blocks.front() : Block::valve;
  fault.block = in.one_of("block", kBlocks, "for effects that several blocks permit", usual_block);
  if (info == nullptr || !effects::has_own_times(*info)) read_schedule(in, fault.schedule);
  if (info != nullptr && in.report().error_count() == errors_before) {
    check(in, fault.effect, fault.block, context);
  }
  return fault;
}

}  // namespace

std::vector<EffectSpec> read_effects(MapReader& in, std::string_view key, Block block,
                                     const effects::EffectContext& context, const char* meaning) {
  std::vector<EffectSpec> effects;
  for (MapReader& item : in.maybe_list(key, meaning)) {
    const std::size_t errors_before = item.report().error_count();
    const Descriptor* info = read_name(item, block);
    if (info == nullptr) continue;
    effects.push_back(read_effect(item, *info, context));
    if (item.report().error_count() == errors_before) check(item, effects.back(), block, context);
  }
  return effects;
}

std::vector<plant::ScheduledFault> read_faults(MapReader& in,
                                               const effects::EffectContext& context) {
  std::vector<plant::ScheduledFault> faults;
  for (MapReader& item :
       in.maybe_list("faults",
                     "scheduled effects; each is an effect with its parameters and these keys, "
                     "except from, to and ramp if the effect has its own from and to")) {
    faults.push_back(read_fault(item, context));
  }
  return faults;
}

std::string describe_effects() {
  std::string text = "| effect | block | parameters | meaning |\n|---|---|---|---|\n";
  for (const Descriptor& info : effects::effect_catalogue()) {
    std::string blocks;
    for (const Block block : info.blocks) {
      blocks += fmt::format("{}{}", blocks.empty() ? "" : " or ", to_text(block));
    }
    std::string parameters;
    const auto separate = [&] { return parameters.empty() ? "" : "; "; };
    for (const effects::ParameterInfo& parameter : info.parameters) {
      const std::string range = to_text(interval(parameter));
      parameters += fmt::format("{}`{}`{}{}, {}: {}", separate(), parameter.name,
                                range.empty() ? "" : " ", range, parameter.unit, parameter.meaning);
      if (parameter.required) continue;
      if (parameter.as_process_lag) {
        parameters += " (default: the process's)";
        continue;
      }
      parameters += parameter.fallback < kInfinity
                        ? fmt::format(" (default {})", brief(parameter.fallback))
                        : " (default none)";
    }
    for (const effects::OptionInfo& option : info.options) {
      parameters += fmt::format("{}`{}`: {}", separate(), option.name, option.meaning);
      for (std::size_t i = 0; i < option.values.size(); ++i) {
        parameters += fmt::format("{}`{}`", i == 0 ? " (" : ", ", option.values[i]);
      }
      parameters += ")";
    }
    if ((info.takes_table && info.options.empty()) || info.is_learned) {
      parameters +=
          fmt::format("{}`table` {}: {}", separate(), info.table.form, info.table.meaning);
    }
    text += fmt::format("| `{}` | {} | {} | {} |\n", info.name, blocks, parameters, info.meaning);
  }
  return text;
}

}  // namespace loopwarden::config
