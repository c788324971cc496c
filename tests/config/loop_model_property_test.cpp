// SPDX-License-Identifier: Apache-2.0
// A written model file reads back equal, for every effect with any valid parameters.
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "config/loop_model_writer.hpp"
#include "model/effects/catalogue.hpp"
#include "tests/config/config_support.hpp"
#include "tests/support/property.hpp"

namespace loop_model_property_test {

using namespace loopwarden;
using namespace loopwarden::config;
using namespace loopwarden::tests::property;

namespace {

double any_value(const effects::ParameterInfo& info) {
  double low = std::max(info.low, -1e6);
  double high = std::min(info.high, 1e6);
  if (info.low_is_open) low = std::nextafter(low, high);
  if (info.high_is_open) high = std::nextafter(high, low);
  return number(low, high);
}

effects::EffectSpec any_spec(const effects::Descriptor& info) {
  effects::EffectSpec spec{.name = info.name};
  for (const effects::OptionInfo& option : info.options) {
    if (coin() || std::string_view(option.name) == "curve")
      spec.options[option.name] = option.values[one_of(option.values.size())];
  }
  const auto curve = spec.options.find("curve");
  const bool needs_table = info.takes_table && info.options.empty();
  if (needs_table || (curve != spec.options.end() && curve->second == "table")) {
    double x = number(0.0, 1.0);
    double q = number(0.0, 1.0);
    const std::int64_t points = integer(2, 8);
    for (std::int64_t i = 0; i < points; ++i) {
      spec.table.emplace_back(x, q);
      x += number(1e-3, 1.0);
      q += number(1e-3, 1.0);
    }
    return spec;
  }
  if (info.is_learned) {
    const auto form = spec.options.find("form");
    if (form != spec.options.end() && form->second == "dynamic") {
      spec.table = {{number(-2.0, 2.0), 1.0}, {number(-2.0, 2.0), number(0.1, 9.0)}};
    } else {
      spec.table = {{number(0.0, 1.0), number(-1.0, 1.0)}, {number(1.5, 3.0), number(-1.0, 1.0)}};
    }
    if (coin()) spec.options["description"] = "what \"it\" says: 40 % \\ # more";
  }
  for (const effects::ParameterInfo& parameter : info.parameters) {
    if (parameter.required || coin()) spec.parameters[parameter.name] = any_value(parameter);
  }
  return spec;
}

// Some parameters exclude each other: such sets are no models.
bool possible(const effects::EffectSpec& spec, effects::Block block,
              const plant::LoopModel& model) {
  try {
    effects::check_effect(spec, block,
                          {.sample_time_s = model.sample_time_s,
                           .output_low = model.controller.pid.output_low,
                           .output_high = model.controller.pid.output_high});
    return true;
  } catch (const effects::EffectError&) {
    return false;
  }
}

void put(plant::LoopModel& model, const effects::EffectSpec& spec, effects::Block block) {
  switch (block) {
    case effects::Block::valve: model.valve_effects.push_back(spec); return;
    case effects::Block::process: model.process_effects.push_back(spec); return;
    case effects::Block::transmitter: model.transmitter_effects.push_back(spec); return;
    case effects::Block::controller:
    case effects::Block::disturbance: model.disturbances.push_back(spec); return;
  }
}

}  // namespace

TEST_CASE("every effect with any parameters is written so that it reads back equal",
          "[config][model][property]") {
  const auto read = read_model_text("m.yaml", test::kModel);
  REQUIRE(read);
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    int written = 0;
    for_all(info.name, 60, [&] {
      plant::LoopModel model = *read;
      const effects::EffectSpec spec = any_spec(info);
      const effects::Block block = info.blocks[one_of(info.blocks.size())];
      if (!possible(spec, block, model)) return;
      ++written;
      if (coin()) {
        put(model, spec, block);
      } else {
        effects::Schedule schedule;
        if (!effects::has_own_times(info)) {
          schedule.from_s = number(-1e5, 1e5);
          if (coin()) schedule.to_s = schedule.from_s + 1.0 + number(0.0, 1e5);
          if (coin()) schedule.ramp_s = number(0.0, 1e4);
        }
        model.scenario.faults.push_back({spec, block, schedule});
      }
      const std::string text = write_model(model);
      const auto again = read_model_text("again.yaml", text);
      if (!again) throw std::runtime_error(text + to_text(again.diagnostics));
      if (!(*again == model)) throw std::runtime_error("reads back otherwise:\n" + text);
      require(write_model(*again) == text, "and is written the same");
    });
    INFO(info.name);
    CHECK(written >= 5);
  }
}

}  // namespace loop_model_property_test
