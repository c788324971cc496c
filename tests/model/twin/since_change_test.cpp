// SPDX-License-Identifier: Apache-2.0
// A change of the loop from a known moment on, by name and size.
#include "model/twin/since_change.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/gap/gap_support.hpp"

namespace since_change_test {

using namespace loopwarden;
using effects::Block;

constexpr double kAt_s = 300.0;

// A loop that is healthy for five minutes, then has `faults` for ten. The times bound its
// beginning.
twin::SinceChange named(const std::vector<std::pair<effects::EffectSpec, Block>>& faults,
                        double earliest_s = kAt_s, double likeliest_s = kAt_s) {
  plant::LoopModel twin = test::believed_model();
  twin.transmitter.noise = 0.015;
  plant::LoopModel truth = twin;
  truth.scenario.set_point = {{0.0, 4.0}};
  for (double t = 20.0; t < 900.0; t += 60.0) {
    truth.scenario.set_point.emplace_back(t, std::fmod(t, 120.0) < 60.0 ? 5.5 : 4.0);
  }
  for (const auto& [spec, block] : faults) {
    truth.scenario.faults.push_back({spec, block, {.from_s = kAt_s}});
  }
  const numeric::LoopRecord record = test::run_of(truth, 900.0);
  const auto sample = [&](double t) { return static_cast<std::size_t>(t / record.period_s); };
  return twin::since_change(record, {sample(earliest_s), sample(likeliest_s)}, twin, test::serial);
}

TEST_CASE("a change since a moment is named with its size, the simplest first",
          "[commission][since]") {
  const auto gain = named({{{"gain_change", {{"factor", 1.3}}}, Block::process}});
  REQUIRE(gain.effects.size() == 1);
  CHECK(gain.effects[0].spec.name == "gain_change");
  CHECK(gain.effects[0].spec.parameters.at("factor") == Approx(1.3).margin(0.02));
  CHECK(gain.effects[0].block == Block::process);
  CHECK(gain.closed > 0.9);
  CHECK_THAT(
      gain.effects[0].evidence,
      Catch::Contains("on the last third of the data. Its parameters are fitted to the data"));

  const auto step = named({{{"output_bias", {{"bias", 0.6}}}, Block::transmitter}});
  REQUIRE(step.effects.size() == 1);
  CHECK(step.effects[0].spec.name == "step_disturbance");
  CHECK(step.effects[0].spec.parameters.at("size") == Approx(0.6).margin(0.05));
  CHECK(step.effects[0].alternatives == std::vector<std::string>{"output_bias"});
  // By the last third the load's filter has absorbed it.
  CHECK_THAT(step.effects[0].evidence,
             Catch::Contains("most of which its parameters are fitted to"));
}

TEST_CASE("a fault of the valve is not attributed to the process", "[commission][since]") {
  const auto play = named({{{"backlash", {{"deadband", 0.6}}}, Block::valve}});
  REQUIRE(play.effects.size() == 1);
  CHECK(play.effects[0].block == Block::valve);
  CHECK((play.effects[0].spec.name == "backlash" || play.effects[0].spec.name == "hysteresis"));
  CHECK(play.closed > 0.8);
}

TEST_CASE("the size of a fault of the valve has an interval", "[commission][since]") {
  const auto sticks = named({{{"stiction", {{"s", 0.9}, {"j", 0.4}}}, Block::valve}});
  REQUIRE(sticks.effects.size() == 1);
  REQUIRE(sticks.effects[0].spec.name == "stiction");
  for (const auto& [name, value] : sticks.effects[0].spec.parameters) {
    const auto& [low, high] = sticks.effects[0].interval.at(name);
    CHECK(low < value);
    CHECK(value < high);
    CHECK(high < 2.0 * low);
  }
}

TEST_CASE("two changes at once are both named", "[commission][since]") {
  const auto both = named({{{"gain_change", {{"factor", 0.7}}}, Block::process},
                           {{"stiction", {{"s", 0.9}, {"j", 0.4}}}, Block::valve}});
  REQUIRE(both.effects.size() == 2);
  const auto has = [&](const char* name) {
    return both.effects[0].spec.name == name || both.effects[1].spec.name == name;
  };
  CHECK(has("gain_change"));
  CHECK(has("stiction"));
}

TEST_CASE("a stick is found however long the valve cycles on a constant set point",
          "[commission][since]") {
  plant::LoopModel twin = test::believed_model();
  twin.transmitter.noise = 0.015;
  for (const auto& [s, j] : {std::pair{0.6, 0.24}, {0.8, 0.56}}) {
    plant::LoopModel truth = twin;
    truth.scenario.set_point = {{0.0, 4.0}, {20.0, 5.0}, {kAt_s + 60.0, 6.0}};
    truth.scenario.faults.push_back(
        {{"stiction", {{"s", s}, {"j", j}}}, Block::valve, {.from_s = kAt_s}});
    const numeric::LoopRecord record = test::run_of(truth, 1500.0);
    const auto change = static_cast<std::size_t>(kAt_s / record.period_s);
    const auto found = twin::since_change(record, {change, change}, twin, test::serial);
    CAPTURE(s, j);
    REQUIRE(found.effects.size() == 1);
    REQUIRE(found.effects[0].spec.name == "stiction");
    CHECK(found.effects[0].spec.parameters.at("s") == Approx(s).epsilon(0.03));
    CHECK(found.effects[0].spec.parameters.at("j") == Approx(j).epsilon(0.05));
  }
}

TEST_CASE("an effect that closes almost no gap in addition to a change is not named",
          "[commission][since]") {
  const auto sticks = named({{{"stiction", {{"s", 0.9}, {"j", 0.4}}}, Block::valve},
                             {{"hysteresis", {{"width", 0.03}}}, Block::valve}});
  REQUIRE(sticks.effects.size() == 1);
  CHECK(sticks.effects[0].spec.name == "stiction");
}

TEST_CASE("an additional hysteresis of a tenth of the stick is named, sizes of both are off",
          "[commission][since]") {
  const auto both = named({{{"stiction", {{"s", 0.9}, {"j", 0.4}}}, Block::valve},
                           {{"hysteresis", {{"width", 0.08}}}, Block::valve}});
  REQUIRE(both.effects.size() == 2);
  CHECK(both.effects[0].spec.name == "stiction");
  CHECK(both.effects[0].spec.parameters.at("s") == Approx(0.74).margin(0.03));
  CHECK(both.effects[0].spec.parameters.at("j") == Approx(0.39).margin(0.02));
  CHECK(both.effects[1].spec.name == "hysteresis");
  CHECK(both.effects[1].spec.parameters.at("width") == Approx(0.155).margin(0.02));
}

TEST_CASE("a moment that is known within bounds is found, with its interval",
          "[commission][since]") {
  const auto gain = named({{{"gain_change", {{"factor", 1.3}}}, Block::process}}, 240.0, 360.0);
  REQUIRE(gain.effects.size() == 1);
  CHECK(gain.effects[0].spec.name == "gain_change");
  CHECK(gain.effects[0].spec.parameters.at("factor") == Approx(1.3).margin(0.02));
  const auto time_s = [](std::size_t sample) { return 0.1 * static_cast<double>(sample); };
  CHECK(time_s(gain.at) == Approx(kAt_s).margin(6.0));
  CHECK(gain.from.begin <= gain.at);
  CHECK(gain.from.end >= gain.at);
  CHECK(time_s(gain.from.begin) > 280.0);
  CHECK(time_s(gain.from.end) < 320.0);
  CHECK(gain.closed > 0.9);
  const auto play = named({{{"backlash", {{"deadband", 0.6}}}, Block::valve}}, 240.0, 330.0);
  REQUIRE(play.effects.size() == 1);
  CHECK(play.effects[0].block == Block::valve);
}

TEST_CASE("a change that began before it could be seen is dated to its beginning",
          "[commission][since]") {
  const auto gain = named({{{"gain_change", {{"factor", 1.3}}}, Block::process}}, 380.0, 400.0);
  REQUIRE(gain.effects.size() == 1);
  CHECK(gain.effects[0].spec.name == "gain_change");
  CHECK(gain.effects[0].spec.parameters.at("factor") == Approx(1.3).margin(0.02));
  CHECK(0.1 * static_cast<double>(gain.at) == Approx(kAt_s).margin(6.0));
}

TEST_CASE("an unchanged loop gets no name", "[commission][since]") {
  CHECK(named({}).effects.empty());
}

}  // namespace since_change_test
