// SPDX-License-Identifier: Apache-2.0
#include "model/effects/catalogue.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "model/alarm/alarm_kind.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/effects/stiction/stiction_he.hpp"
#include "model/effects/stiction/stiction_inertial.hpp"
#include "model/effects/stiction/stiction_karnopp.hpp"

namespace catalogue_test {

using namespace loopwarden;
using namespace loopwarden::effects;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr EffectContext kContext{.sample_time_s = 0.1, .output_low = 0.0, .output_high = 10.0};

double middle(const ParameterInfo& p) {
  if (std::isfinite(p.low) && std::isfinite(p.high)) return (p.low + p.high) / 2.0;
  return std::isfinite(p.low) ? p.low + 1.0 : 1.0;
}

// Sets every parameter to the middle of its range. A hysteresis has only one of its two.
EffectSpec mid_range(const Descriptor& info) {
  EffectSpec spec{.name = info.name};
  for (const ParameterInfo& p : info.parameters) spec.parameters[p.name] = middle(p);
  if (spec.name == "hysteresis") spec.parameters.erase("offset");
  if (spec.name == "stiction") {  // no law takes all of them
    spec.options["law"] = "inertial";
    spec.parameters.erase("s_closing");
    spec.parameters.erase("j_closing");
  }
  if (spec.parameters.contains("to")) spec.parameters["to"] = spec.parameters["from"] + 1.0;
  if (spec.name == "clipped_measurement") spec.parameters["high"] = 2.0;
  if (spec.name == "varying_gain") spec.table = {{0.0, 1.0}, {1.0, 2.0}};
  if (spec.name == "learned") spec.table = {{0.0, 2.0}, {1.0, 2.0}};
  return spec;
}

EffectSpec stiction(double s, double j) {
  return {.name = "stiction", .parameters = {{"s", s}, {"j", j}}};
}

// Returns the key that the error names, or "none" without an error.
std::string complaint(const EffectSpec& spec, Block block, std::string* message = nullptr) {
  try {
    check_effect(spec, block, kContext);
  } catch (const EffectError& error) {
    if (message != nullptr) *message = error.what();
    return error.key();
  }
  return "none";
}

}  // namespace

TEST_CASE("the vocabulary of effects is complete", "[effects][catalogue]") {
  for (const char* name :
       {"stiction", "backlash", "hysteresis", "low_air_supply", "valve_characteristic",
        "cam_obstruction", "positioner_overshoot", "gain_change", "extra_dead_time", "extra_lag",
        "output_bias", "drift", "oscillating_disturbance", "step_disturbance"}) {
    CAPTURE(name);
    CHECK(find_effect(name) != nullptr);
  }
  CHECK(find_effect("controller_mismatch") == nullptr);  // only found in a record, never simulated
  REQUIRE(find_word("controller_mismatch") != nullptr);
  CHECK(find_word("gremlins") == nullptr);
  CHECK(find_effect("Stiction") == nullptr);
}

TEST_CASE("names are unique and every entry explains itself", "[effects][catalogue]") {
  std::set<std::string> names;
  for (const Descriptor& info : effect_catalogue()) {
    CAPTURE(info.name);
    CHECK(names.insert(info.name).second);
    CHECK_FALSE(info.blocks.empty());
    CHECK(std::string(info.meaning).size() > 5);
    CHECK(std::string(info.header).ends_with(".hpp"));
    for (const ParameterInfo& p : info.parameters) {
      CHECK(std::string(p.unit).size() > 0);
      CHECK(std::string(p.meaning).size() > 0);
      CHECK(p.low < p.high);
    }
  }
}

TEST_CASE("numbers keep their given text, and a parameter is given once", "[effects][catalogue]") {
  const std::vector<std::string> numbered{"stiction",
                                          "backlash",
                                          "hysteresis",
                                          "low_air_supply",
                                          "valve_characteristic",
                                          "cam_obstruction",
                                          "positioner",
                                          "positioner_overshoot",
                                          "positioner_lag",
                                          "gain_change",
                                          "extra_dead_time",
                                          "extra_lag",
                                          "output_bias",
                                          "drift",
                                          "oscillating_disturbance",
                                          "step_disturbance",
                                          "random_load",
                                          "controller_mismatch"};
  for (std::size_t i = 0; i < numbered.size(); ++i) {
    CAPTURE(numbered[i]);
    REQUIRE(find_word(numbered[i]) != nullptr);
    CHECK(find_word(numbered[i])->number == static_cast<int>(i) + 1);
  }
  std::set<int> numbers;
  for (const Descriptor& info : vocabulary()) numbers.insert(info.number);
  CHECK(numbers.size() == vocabulary().size());
  CHECK(*numbers.begin() == 1);
  CHECK(*numbers.rbegin() == static_cast<int>(vocabulary().size()));  // no hole
  // Guides and searches are ordered by number, independent of file names and link order.
  int last = 0;
  for (const Descriptor& info : effect_catalogue()) {
    CHECK(info.number > last);
    last = info.number;
  }
}

TEST_CASE("every word has a guide, and an example that can be simulated", "[effects][catalogue]") {
  for (const Descriptor& info : vocabulary()) {
    CAPTURE(info.name);
    CHECK(std::string(info.seen).size() > 20);
    CHECK(std::string(info.remedy).size() > 20);
    CHECK_FALSE(info.look_alikes.empty());
    CHECK_FALSE(info.examples.empty());
    for (const Example& example : info.examples) {
      CHECK(example.spec.name == info.name);
      if (info.make != nullptr) {
        CHECK_NOTHROW(check_effect(example.spec, example.block, kContext));
      }
    }
  }
}

TEST_CASE("an effect explains the alarm with its name and those of its kind",
          "[effects][catalogue]") {
  using alarm::kValveAlarms;
  for (const Descriptor& info : vocabulary()) {
    CAPTURE(info.name);
    CHECK(agrees(info, "model_gap"));
    for (const std::string_view alarm : info.alarms) {
      CHECK(std::any_of(kValveAlarms.begin(), kValveAlarms.end(),
                        [&](const auto kind) { return alarm == alarm::to_text(kind); }));
    }
    // Valve alarms are for valve effects, and each of these explains one.
    // A learned effect has no cause that an alarm could name.
    CHECK(info.alarms.empty() == (info.blocks.front() != Block::valve || info.is_learned));
  }
  for (const auto kind : kValveAlarms) {
    const Descriptor* own = find_word(alarm::to_text(kind));
    if (own != nullptr) CHECK(agrees(*own, own->name));
  }
  CHECK(agrees(*find_effect("cam_obstruction"), "stiction"));
  CHECK(agrees(*find_effect("backlash"), "hysteresis"));
  CHECK(agrees(*find_effect("hysteresis"), "backlash"));
  CHECK(agrees(*find_effect("positioner_lag"), "unknown"));
  CHECK_FALSE(agrees(*find_effect("backlash"), "stiction"));
  CHECK_FALSE(agrees(*find_effect("gain_change"), "unknown"));
}

TEST_CASE("every effect can be made in every block that allows it, and stepped",
          "[effects][catalogue]") {
  for (const Descriptor& info : effect_catalogue()) {
    CAPTURE(info.name);
    const EffectSpec spec = mid_range(info);
    for (const Block block : info.blocks) REQUIRE_NOTHROW(check_effect(spec, block, kContext));
    effects::EffectChain chain;
    chain.add(make_effect(spec, kContext));
    REQUIRE(std::isfinite(chain.reset(5.0, 0.0)));
    for (int k = 0; k < 500; ++k) {
      REQUIRE(std::isfinite(chain.step(5.0 + 4.0 * std::sin(0.05 * k), 0.1 * k)));
    }
  }
}

TEST_CASE("every effect is absent at severity 0", "[effects][catalogue]") {
  for (const Descriptor& info : effect_catalogue()) {
    CAPTURE(info.name);
    EffectSpec spec = mid_range(info);
    if (spec.name == "valve_characteristic") spec.options["curve"] = "butterfly";
    effects::EffectChain chain;
    // Scheduled after the end: severity 0 all the time.
    chain.add(make_effect(spec, kContext), {.from_s = 1e6});
    REQUIRE(chain.reset(5.0, 0.0) == Approx(5.0));
    for (int k = 0; k < 200; ++k) {
      const double u = 5.0 + 4.0 * std::sin(0.05 * k);
      REQUIRE(chain.step(u, 0.1 * k) == Approx(u));
    }
  }
}

TEST_CASE("every effect does something at severity 1", "[effects][catalogue]") {
  EffectContext context = kContext;
  context.dead_time_s = 1.0;
  for (const Descriptor& info : effect_catalogue()) {
    CAPTURE(info.name);
    EffectSpec spec = mid_range(info);
    if (spec.name == "valve_characteristic") spec.options["curve"] = "butterfly";
    if (spec.name == "gain_change") spec.parameters["factor"] = 1.5;
    effects::EffectChain chain;
    chain.add(make_effect(spec, context));
    chain.reset(5.0, 0.0);
    double farthest = 0.0;
    for (int k = 0; k < 200; ++k) {
      const double u = 5.0 + 4.0 * std::sin(0.05 * k);
      farthest = std::max(farthest, std::abs(chain.step(u, 0.1 * k) - u));
    }
    CHECK(farthest > 0.1);
  }
}

TEST_CASE("every value outside its range is refused by name", "[effects][catalogue]") {
  for (const Descriptor& info : effect_catalogue()) {
    for (const ParameterInfo& p : info.parameters) {
      CAPTURE(info.name, p.name);
      std::vector<double> bad{kNan, kInfinity, -kInfinity};
      if (std::isfinite(p.low)) {
        bad.push_back(std::nextafter(p.low, -kInfinity));
        if (p.low_is_open) bad.push_back(p.low);
      }
      if (std::isfinite(p.high)) {
        bad.push_back(std::nextafter(p.high, kInfinity));
        if (p.high_is_open) bad.push_back(p.high);
      }
      for (const double value : bad) {
        CAPTURE(value);
        EffectSpec spec = mid_range(info);
        spec.parameters[p.name] = value;
        std::string message;
        CHECK(complaint(spec, info.blocks.front(), &message) == p.name);
        CHECK(message.find(p.name) != std::string::npos);
      }
    }
  }
}

TEST_CASE("every required parameter that is missing is named", "[effects][catalogue]") {
  for (const Descriptor& info : effect_catalogue()) {
    for (const ParameterInfo& p : info.parameters) {
      if (!p.required) continue;
      CAPTURE(info.name, p.name);
      EffectSpec spec = mid_range(info);
      spec.parameters.erase(p.name);
      std::string message;
      CHECK(complaint(spec, info.blocks.front(), &message).empty());
      CHECK(message.find(p.name) != std::string::npos);
    }
  }
}

TEST_CASE("the ends of closed ranges are allowed", "[effects][catalogue]") {
  for (const Descriptor& info : effect_catalogue()) {
    for (const ParameterInfo& p : info.parameters) {
      CAPTURE(info.name, p.name);
      EffectSpec spec = mid_range(info);
      if (spec.parameters.contains("j")) spec.parameters["j"] = 0.0;
      if (p.name == std::string("s_closing") || p.name == std::string("j_closing")) continue;
      if (spec.name == "hysteresis" && p.name == std::string("offset")) continue;
      if (std::isfinite(p.low) && !p.low_is_open) {
        spec.parameters[p.name] = p.low;
        CHECK(complaint(spec, info.blocks.front()) == "none");
      }
    }
  }
}

TEST_CASE("the actuator's dynamics belong to the inertial law, within the sampling rate",
          "[effects][catalogue]") {
  EffectSpec spec = stiction(1.0, 0.3);
  spec.parameters["natural_frequency"] = 5.0;
  CHECK(complaint(spec, Block::valve) == "natural_frequency");
  spec.options["law"] = "inertial";
  CHECK(complaint(spec, Block::valve) == "none");
  spec.parameters["natural_frequency"] = 1.01 * 3.14159265358979 / kContext.sample_time_s;
  CHECK(complaint(spec, Block::valve) == "natural_frequency");
  EffectSpec offset{.name = "hysteresis", .parameters = {{"offset", 0.5}, {"knee", 0.0}}};
  CHECK(complaint(offset, Block::valve) == "knee");
}

TEST_CASE("unknown parameters of an effect are refused", "[effects][catalogue]") {
  CHECK(complaint({.name = "sticktion"}, Block::valve) == "effect");
  EffectSpec spec = stiction(1.0, 0.3);
  CHECK(complaint(spec, Block::process) == "effect");
  spec.parameters["k"] = 1.0;
  CHECK(complaint(spec, Block::valve) == "k");

  spec = stiction(1.0, 0.3);
  spec.options["law"] = "kano";
  std::string message;
  CHECK(complaint(spec, Block::valve, &message) == "law");
  CHECK(message.find("choudhury, he, karnopp") != std::string::npos);
  spec.options = {{"filling", "one_sided"}};
  CHECK(complaint(spec, Block::valve) == "filling");

  spec = stiction(1.0, 0.3);
  spec.table = {{0.0, 0.0}, {1.0, 1.0}};
  CHECK(complaint(spec, Block::valve) == "table");
}

TEST_CASE("parameters that must fit each other", "[effects][catalogue]") {
  CHECK(complaint(stiction(1.0, 1.0), Block::valve) == "none");
  CHECK(complaint(stiction(1.0, 1.01), Block::valve) == "j");

  EffectSpec cam{.name = "cam_obstruction",
                 .parameters = {{"position", 4.0}, {"band", 1.0}, {"jump", 1.5}}};
  CHECK(complaint(cam, Block::valve) == "jump");
  cam.parameters["jump"] = 1.0;
  CHECK(complaint(cam, Block::valve) == "none");

  EffectSpec hysteresis{.name = "hysteresis"};
  CHECK(complaint(hysteresis, Block::valve).empty());
  hysteresis.parameters = {{"offset", 0.7}, {"width", 0.7}};
  CHECK(complaint(hysteresis, Block::valve).empty());
  hysteresis.parameters = {{"offset", 0.7}};
  CHECK(complaint(hysteresis, Block::valve) == "none");

  EffectSpec delay{.name = "extra_dead_time", .parameters = {{"seconds", 1e12}}};
  CHECK(complaint(delay, Block::process) == "seconds");
}

TEST_CASE("a table of a characteristic rises and is of a size that fits", "[effects][catalogue]") {
  EffectSpec spec{.name = "valve_characteristic", .options = {{"curve", "table"}}};
  const auto with = [&](std::vector<std::pair<double, double>> points) {
    spec.table = std::move(points);
    return complaint(spec, Block::valve);
  };
  CHECK(with({{0.0, 0.0}, {5.0, 2.0}, {10.0, 10.0}}) == "none");
  CHECK(with({}) == "table");
  CHECK(with({{0.0, 0.0}}) == "table");
  CHECK(with({{0.0, 0.0}, {0.0, 2.0}}) == "table");
  CHECK(with({{0.0, 2.0}, {5.0, 2.0}}) == "table");
  CHECK(with({{0.0, 0.0}, {kNan, 2.0}}) == "table");
  CHECK(with({{0.0, 0.0}, {5.0, kInfinity}}) == "table");
  std::vector<std::pair<double, double>> points;
  for (int i = 0; i < 20; ++i) points.emplace_back(i, 2 * i);
  CHECK(with(points) == "none");
  points.emplace_back(20.0, 40.0);
  CHECK(with(points) == "table");
  spec.options["curve"] = "butterfly";
  CHECK(with({{0.0, 0.0}, {5.0, 2.0}}) == "table");
}

TEST_CASE("options choose the variant", "[effects][catalogue]") {
  const auto made = [](EffectSpec spec, const char* option, const char* value) {
    spec.options[option] = value;
    return make_effect(spec, kContext);
  };
  // The same steps as the law itself.
  const auto steps_as = [](effects::Effect effect, auto law) {
    bool same = effect.reset(5.0) == law.reset(5.0);
    for (int k = 0; k < 300; ++k) {
      const double u = 5.0 + 4.0 * std::sin(0.05 * k);
      same = same && effect.step(u, 0.1 * k) == law.step(u);
    }
    return same;
  };
  const effects::StictionParameters p{1.0, 0.3};
  const EffectSpec spec = stiction(1.0, 0.3);
  CHECK(steps_as(make_effect(spec, kContext), effects::StictionChoudhury(p)));
  CHECK(steps_as(made(spec, "law", "he"), effects::StictionHe(p)));
  CHECK(steps_as(made(spec, "law", "karnopp"), effects::StictionKarnopp(p, 0.1)));
  CHECK(steps_as(made(spec, "law", "inertial"), effects::StictionInertial(p, {}, 0.1)));
  CHECK_FALSE(steps_as(made(spec, "law", "he"), effects::StictionChoudhury(p)));

  const EffectSpec air{.name = "low_air_supply", .parameters = {{"rate", 1.0}}};
  effects::Effect spring = made(air, "filling", "one_sided");
  spring.reset(9.0);
  CHECK(spring.step(2.0, 0.0) == Approx(2.0));

  EffectSpec curve{.name = "valve_characteristic"};
  // Rangeability 30 by default, over the output's range of 0 to 10.
  CHECK(made(curve, "curve", "equal_percentage").step(5.0, 0.0) ==
        Approx(10.0 / (std::sqrt(30.0) + 1.0)));
  curve.table = {{0.0, 1.0}, {10.0, 7.0}};
  CHECK(made(curve, "curve", "table").step(5.0, 0.0) == Approx(4.0));
}

TEST_CASE("blocks are named as in files", "[effects][catalogue]") {
  CHECK(to_text(Block::controller) == std::string("controller"));
  CHECK(to_text(Block::valve) == std::string("valve"));
  CHECK(to_text(Block::process) == std::string("process"));
  CHECK(to_text(Block::transmitter) == std::string("transmitter"));
  CHECK(to_text(Block::disturbance) == std::string("disturbance"));
}

}  // namespace catalogue_test
