// SPDX-License-Identifier: Apache-2.0
#include "config/effect_reader.hpp"

#include "config/loop_model_writer.hpp"
#include "tests/config/config_support.hpp"

namespace effect_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::kModel;

namespace {

std::string with_valve(const std::string& effect) {
  return kModel + "valve:\n  effects:\n    - " + effect + "\n";
}
std::string said_of(const std::string& effect) { return test::said_of_model(with_valve(effect)); }

effects::EffectSpec read(const std::string& effect) {
  const auto model = read_model_text("m.yaml", with_valve(effect));
  INFO(to_text(model.diagnostics));
  REQUIRE(model);
  REQUIRE(model->valve_effects.size() == 1);
  return model->valve_effects.front();
}

}  // namespace

TEST_CASE("Effects are read by the catalogue", "[config][effects]") {
  const effects::EffectSpec stiction = read("{effect: stiction, s: 0.9, j: 0.3, law: karnopp}");
  CHECK(stiction.name == "stiction");
  CHECK(stiction.parameters == std::map<std::string, double>{{"j", 0.3}, {"s", 0.9}});
  CHECK(stiction.options == std::map<std::string, std::string>{{"law", "karnopp"}});
  CHECK(read("{effect: low_air_supply, rate: 2}").parameters ==
        std::map<std::string, double>{{"rate", 2.0}});
}

TEST_CASE("A valve characteristic has a curve or a table", "[config][effects]") {
  const effects::EffectSpec named =
      read("{effect: valve_characteristic, curve: {name: equal_percentage, rangeability: 40}}");
  CHECK(named.options.at("curve") == "equal_percentage");
  CHECK(named.parameters.at("rangeability") == 40.0);
  CHECK(read("{effect: valve_characteristic, curve: butterfly}").options.at("curve") ==
        "butterfly");
  const effects::EffectSpec table =
      read("{effect: valve_characteristic, table: [[0, 0], [5, 2], [10, 10]]}");
  CHECK(table.options.at("curve") == "table");
  CHECK(table.table == std::vector<std::pair<double, double>>{{0, 0}, {5, 2}, {10, 10}});

  CHECK(said_of("{effect: valve_characteristic}") ==
        "m.yaml:14:7: error: valve.effects[0]: needs a curve or a table\n");
  CHECK(said_of("{effect: valve_characteristic, curve: table}") ==
        "m.yaml:14:45: error: valve.effects[0].curve: must be linear, equal_percentage, "
        "quick_opening "
        "or butterfly (got 'table')\n");
  CHECK(said_of("{effect: valve_characteristic, curve: linear, table: [[0, 0], [1, 1]]}") ==
        "m.yaml:14:60: error: valve.effects[0].table: conflicts with curve (at 14:45); give one of "
        "them\n");
  CHECK(said_of("{effect: valve_characteristic, table: [[0, 0], [5, 2], [5, 10]]}") ==
        "m.yaml:14:45: error: valve.effects[0].table: table must rise in both columns (see point "
        "3)\n");
  CHECK(
      said_of("{effect: valve_characteristic, curve: {name: equal_percentage, rangeability: 1}}") ==
      "m.yaml:14:84: error: valve.effects[0].curve.rangeability: must be > 1 and <= 1000000 (got "
      "1)\n");
}

TEST_CASE("An effect of the process may need a table, or the process's lag", "[config][effects]") {
  const auto text = [](const std::string& fault) {
    return kModel + "scenario:\n  faults:\n    - " + fault + "\n";
  };
  const auto of = [&](const std::string& fault) {
    const auto model = read_model_text("m.yaml", text(fault));
    INFO(to_text(model.diagnostics));
    REQUIRE(model);
    REQUIRE(model->scenario.faults.size() == 1);
    const effects::EffectSpec& effect = model->scenario.faults.front().effect;
    // The written text is read as the same effect.
    const auto again = read_model_text("again.yaml", write_model(*model));
    REQUIRE(again);
    CHECK(again->scenario.faults.front().effect == effect);
    return std::make_pair(effect, model->process.time_constant_s);
  };
  const auto gain = of("{effect: varying_gain, table: [[0, 1], [50, 0.8]]}").first;
  CHECK(gain.table == std::vector<std::pair<double, double>>{{0, 1}, {50, 0.8}});
  CHECK(gain.options.empty());
  CHECK(test::said_of_model(text("{effect: varying_gain}"))
            .find("needs a table: [[t, factor], ...]") != std::string::npos);

  const auto play =
      of("{effect: learned, form: hysteretic, thresholds: [0, 0.4], weights: [0.3, 0.7], "
         "offset: 0.1, description: \"late by 0.8\"}")
          .first;
  CHECK(play.table == std::vector<std::pair<double, double>>{{0, 0.3}, {0.4, 0.7}});
  CHECK(play.options.at("description") == "late by 0.8");
  const auto tail =
      of("{effect: learned, form: dynamic, numerator: [1], denominator: [1, 15]}").first;
  CHECK(tail.table == std::vector<std::pair<double, double>>{{1, 1}, {0, 15}});
  CHECK(test::said_of_model(
            text("{effect: learned, form: dynamic, numerator: [1, 2, 3], denominator: [1, 5]}"))
            .find("numerator: must have as many entries as denominator (2, got 3)") !=
        std::string::npos);
  CHECK(test::said_of_model(text("{effect: learned, form: hysteretic, thresholds: [1]}"))
            .find("needs thresholds and weights") != std::string::npos);
  CHECK(test::said_of_model(text("{effect: learned}")).find("needs a table: [[in, out], ...]") !=
        std::string::npos);
  CHECK(test::said_of_model(
            text("{effect: learned, form: dynamic, numerator: [1], denominator: [1, -5]}"))
            .find("does not die away") != std::string::npos);

  const auto [rings, lag_s] =
      of("{effect: oscillatory_process, damping: 0.3, natural_frequency: 0.5}");
  CHECK(rings.parameters.at("time_constant") == lag_s);
  CHECK(of("{effect: oscillatory_process, damping: 0.3, natural_frequency: 0.5, time_constant: 77}")
            .first.parameters.at("time_constant") == 77.0);
}

TEST_CASE("A fault with its own times takes no additional schedule", "[config][effects]") {
  const auto text = [](const std::string& more) {
    return kModel +
           "scenario:\n  faults:\n    - {effect: intermittent_stiction, s: 1, j: 0.5, from: 20, "
           "to: 60" +
           more + "}\n";
  };
  const auto model = read_model_text("m.yaml", text(""));
  INFO(to_text(model.diagnostics));
  REQUIRE(model);
  const plant::ScheduledFault& fault = model->scenario.faults.front();
  CHECK(fault.effect.parameters.at("from") == 20.0);
  CHECK(fault.effect.parameters.at("to") == 60.0);
  CHECK(fault.schedule == effects::Schedule{});
  CHECK_THAT(test::said_of_model(text(", ramp: 5")), Catch::Contains("unknown key 'ramp'"));
}

TEST_CASE("Errors of an effect are reported at the wrong key", "[config][effects]") {
  CHECK(said_of("{effect: sticktion, s: 1, j: 0}") ==
        "m.yaml:14:16: error: valve.effects[0].effect: unknown effect 'sticktion'; did you mean "
        "'stiction'?\n");
  CHECK(said_of("{s: 1}") ==
        "m.yaml:14:7: error: missing key 'effect' in 'valve.effects[0]' (text)\n");
  CHECK(said_of("{effect: stiction, s: 0.2, j: 0.3}") ==
        "m.yaml:14:37: error: valve.effects[0].j: j must be at most s = 0.2 CO units (got 0.3)\n");
  CHECK(said_of("{effect: stiction, s: -1, jj: 0.3}") ==
        "m.yaml:14:7: error: missing key 'j' in 'valve.effects[0]' (number >= 0, CO units)\n"
        "m.yaml:14:29: error: valve.effects[0].s: must be >= 0 CO units (got -1)\n"
        "m.yaml:14:33: error: unknown key 'jj'; did you mean 'j'?\n");
  CHECK(said_of("{effect: stiction, s: 1, j: 0, law: karnop}") ==
        "m.yaml:14:43: error: valve.effects[0].law: must be choudhury, he, karnopp or inertial "
        "(got 'karnop'); "
        "did you mean 'karnopp'?\n");
  CHECK(said_of("{effect: drift, rate: 1}") ==
        "m.yaml:14:16: error: valve.effects[0].effect: 'drift' belongs to the transmitter, not to "
        "the "
        "valve\n");
  CHECK(said_of("{effect: hysteresis, width: 1, offset: 1}") ==
        "m.yaml:14:7: error: valve.effects[0]: hysteresis takes either offset or width\n");
}

TEST_CASE("Faults begin and end on a schedule", "[config][effects]") {
  const auto fault_text = [](const std::string& fault) {
    return kModel + "scenario:\n  faults:\n    - " + fault + "\n";
  };
  const auto model = read_model_text(
      "m.yaml", fault_text("{effect: stiction, s: 1, j: 0.4, from: 120, to: 300, ramp: 60}"));
  REQUIRE(model);
  REQUIRE(model->scenario.faults.size() == 1);
  const plant::ScheduledFault& fault = model->scenario.faults.front();
  CHECK(fault.block == effects::Block::valve);
  CHECK(fault.schedule == effects::Schedule{.from_s = 120, .to_s = 300, .ramp_s = 60});

  const auto lag = read_model_text(
      "m.yaml", fault_text("{effect: extra_lag, time_constant: 2, block: transmitter}"));
  REQUIRE(lag);
  CHECK(lag->scenario.faults.front().block == effects::Block::transmitter);
  CHECK(lag->scenario.faults.front().schedule.always());

  CHECK(
      test::said_of_model(fault_text("{effect: stiction, s: 1, j: 0, from: 9, to: 9}")) ==
      "m.yaml:14:51: error: scenario.faults[0].to: must be after from = 9 s (at 14:44) (got 9)\n");
  CHECK(test::said_of_model(fault_text("{effect: stiction, s: 1, j: 0, ramp: 9}")) ==
        "m.yaml:14:44: error: scenario.faults[0].ramp: needs from, the time at which the effect "
        "begins "
        "to grow\n");
  CHECK(
      test::said_of_model(fault_text("{effect: stiction, s: 1, j: 0, block: process}")) ==
      "m.yaml:14:16: error: scenario.faults[0].effect: effect 'stiction' belongs to the valve, not "
      "to the process\n");
}

TEST_CASE("Every effect of the catalogue can be read and is described", "[config][effects]") {
  const std::string table = describe_effects();
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    CHECK(table.find("| `" + std::string(info.name) + "` |") != std::string::npos);
  }
  // Its example is read from a model file as it was written.
  const auto base = read_model_text("m.yaml", kModel);
  REQUIRE(base);
  for (const effects::Descriptor& info : effects::effect_catalogue()) {
    for (const effects::Example& example : info.examples) {
      plant::LoopModel model = *base;
      auto& list = example.block == effects::Block::valve         ? model.valve_effects
                   : example.block == effects::Block::process     ? model.process_effects
                   : example.block == effects::Block::transmitter ? model.transmitter_effects
                                                                  : model.disturbances;
      list = {example.spec};
      const auto read_back = read_model_text("m.yaml", write_model(model));
      INFO(example.file << "\n" << to_text(read_back.diagnostics));
      REQUIRE(read_back);
      CHECK(*read_back == model);
    }
  }
}

}  // namespace effect_reader_test
