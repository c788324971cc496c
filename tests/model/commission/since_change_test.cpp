// SPDX-License-Identifier: Apache-2.0
// A change of the twin from a known moment on, by name and size.
#include "model/commission/since_change.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/gap/gap_support.hpp"

namespace since_change_test {

using namespace loopwarden;
using plant::Block;

constexpr double kAt_s = 300.0;

// Healthy for five minutes, ten more with `faults`.
commission::SinceChange named(const std::vector<std::pair<plant::EffectSpec, Block>>& faults) {
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
  const gap::Record record = test::run_of(truth, 900.0);
  return commission::since_change(record, static_cast<std::size_t>(kAt_s / record.period_s), twin,
                                  test::serial);
}

TEST_CASE("a change since a moment is named with its size, the plainest first",
          "[commission][since]") {
  const auto gain = named({{{"gain_change", {{"factor", 1.3}}}, Block::process}});
  REQUIRE(gain.effects.size() == 1);
  CHECK(gain.effects[0].spec.name == "gain_change");
  CHECK(gain.effects[0].spec.parameters.at("factor") == Approx(1.3).margin(0.02));
  CHECK(gain.effects[0].block == Block::process);
  CHECK(gain.closed > 0.9);

  const auto step = named({{{"output_bias", {{"bias", 0.6}}}, Block::transmitter}});
  REQUIRE(step.effects.size() == 1);
  CHECK(step.effects[0].spec.name == "step_disturbance");
  CHECK(step.effects[0].spec.parameters.at("size") == Approx(0.6).margin(0.05));
  CHECK(step.effects[0].alternatives == std::vector<std::string>{"output_bias"});
}

TEST_CASE("a fault of the valve is none of the process", "[commission][since]") {
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

TEST_CASE("where nothing changed, nothing is named", "[commission][since]") {
  CHECK(named({}).effects.empty());
}

}  // namespace since_change_test
