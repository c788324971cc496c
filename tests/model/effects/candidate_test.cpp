// SPDX-License-Identifier: Apache-2.0
#include "model/effects/candidate.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "model/effects/catalogue.hpp"

namespace candidate_test {

using namespace loopwarden;
using namespace loopwarden::effects;

namespace {

// Loops with other units and speeds than the examples.
std::vector<SearchContext> contexts() {
  return {{.output_high = 10.0, .output_used_low = 2.0, .output_used_high = 7.0},
          {.output_low = 4.0,
           .output_high = 20.0,
           .output_used_low = 4.0,
           .output_used_high = 20.0,
           .period_s = 1.0,
           .duration_s = 4000.0,
           .time_constant_s = 60.0,
           .dead_time_s = 20.0},
          {.output_used_low = 49.5,
           .output_used_high = 51.5,
           .period_s = 0.05,
           .duration_s = 10.0,
           .time_constant_s = 0.6,
           .dead_time_s = 0.0}};
}

EffectContext effect_context(const SearchContext& c) {
  return {.sample_time_s = c.period_s, .output_low = c.output_low, .output_high = c.output_high};
}

}  // namespace

TEST_CASE("every candidate is an effect of the catalogue, in a block that allows it",
          "[effects][candidate]") {
  std::set<std::string> names;
  for (const Candidate& c : candidates({})) {
    CAPTURE(c.name);
    names.insert(c.name);
    const Descriptor* info = find_effect(c.name);
    REQUIRE(info != nullptr);
    CHECK(std::find(info->blocks.begin(), info->blocks.end(), c.block) != info->blocks.end());
    CHECK(c.starts >= 1);
    if (c.starts_offset()) CHECK(std::string(c.search.back().name) == "start");
  }
  // A record can show all of these effects. Another controller is found without a fit.
  for (const char* name :
       {"stiction", "backlash", "hysteresis", "low_air_supply", "valve_characteristic",
        "cam_obstruction", "positioner_overshoot", "gain_change", "extra_dead_time", "extra_lag",
        "output_bias", "drift", "oscillating_disturbance", "step_disturbance"}) {
    CHECK(names.contains(name));
  }
  CHECK_FALSE(names.contains("controller_mismatch"));
  CHECK_FALSE(names.contains("random_load"));
}

TEST_CASE("the corners of every search are effects that can be stepped", "[effects][candidate]") {
  for (const SearchContext& context : contexts()) {
    for (const Candidate& c : candidates(context)) {
      const std::size_t corners = std::size_t{1} << c.search.size();
      for (std::size_t corner = 0; corner <= corners; ++corner) {  // the last iteration: the middle
        std::vector<double> values;
        for (std::size_t j = 0; j < c.search.size(); ++j) {
          const double place = corner == corners ? 0.5 : (corner >> j & 1U) != 0 ? 1.0 : 0.0;
          values.push_back(c.search[j].value(place));
        }
        const std::vector<double> solved(2, 0.7);
        const effects::EffectSpec spec = c.effect(values, solved);
        CAPTURE(c.name, corner, context.period_s);
        CHECK(spec.name == c.name);
        CHECK_NOTHROW(check_effect(spec, c.block, effect_context(context)));
        // An effect in the signal's path has no solved parameters.
        if (c.in_path()) CHECK(c.effect(values, {}) == spec);
      }
    }
  }
}

TEST_CASE("a searched value and its place go back and forth", "[effects][candidate]") {
  for (const SearchContext& context : contexts()) {
    for (const Candidate& c : candidates(context)) {
      for (const SearchRange& range : c.search) {
        CAPTURE(c.name, range.name);
        REQUIRE(range.low < range.high);
        CHECK(range.value(0.0) == Approx(range.low));
        CHECK(range.value(1.0) == Approx(range.high));
        for (const double place : {0.0, 0.2, 0.5, 0.93, 1.0}) {
          CHECK(range.position(range.value(place)) == Approx(place).margin(1e-9));
        }
        CHECK(range.value(-3.0) == range.value(0.0));
        CHECK(range.position(range.high + 1.0) == Approx(1.0));
      }
    }
  }
}

TEST_CASE("a logarithmic range has the geometric mean in its middle", "[effects][candidate]") {
  CHECK(SearchRange{"x", 0.1, 10.0, true, 1}.value(0.5) == Approx(1.0));
  CHECK(SearchRange{"x", 0.1, 10.0, false, 1}.value(0.5) == Approx(5.05));
}

TEST_CASE("a sine's amplitude and phase follow from the solved columns", "[effects][candidate]") {
  for (const Candidate& c : candidates({})) {
    if (c.name != std::string("oscillating_disturbance")) continue;
    const std::vector<double> period{12.0};
    const effects::EffectSpec spec = c.effect(period, std::vector<double>{3.0, 4.0});
    CHECK(spec.parameters.at("amplitude") == Approx(5.0));
    CHECK(spec.parameters.at("phase") == Approx(std::atan2(4.0, 3.0)));
    CHECK(spec.parameters.at("period") == 12.0);
  }
}

TEST_CASE("a valve has one friction, and the plug follows it", "[effects][candidate]") {
  std::set<std::string> frictions;
  for (const Candidate& c : candidates({})) {
    if (c.friction) frictions.insert(c.name);
  }
  for (const char* name : {"stiction", "backlash", "hysteresis", "cam_obstruction"}) {
    CHECK(frictions.contains(name));
  }
  for (const char* name : {"low_air_supply", "positioner_overshoot", "valve_characteristic"}) {
    CHECK_FALSE(frictions.contains(name));
  }
  const auto rank = [](const char* name) { return find_effect(name)->valve_rank; };
  CHECK(rank("positioner_overshoot") < rank("low_air_supply"));
  CHECK(rank("low_air_supply") < rank("stiction"));
  CHECK(rank("stiction") < rank("backlash"));
  CHECK(rank("backlash") < rank("valve_characteristic"));
}

TEST_CASE("the law of a healthy valve belongs to one effect, and it can be stepped",
          "[effects][candidate]") {
  int laws = 0;
  for (const Descriptor& info : effect_catalogue()) {
    if (info.healthy_valve == nullptr) continue;
    ++laws;
    const EffectSpec spec = info.healthy_valve(0.2, 8.0, 0.3);
    CHECK(spec.name == info.name);
    CHECK_NOTHROW(check_effect(spec, Block::valve, {}));
  }
  CHECK(laws == 1);
}

TEST_CASE("a place of the travel shows if CO left it and returned on both sides",
          "[effects][candidate]") {
  const std::vector<Candidate> all = candidates({});
  const auto cam = std::find_if(all.begin(), all.end(), [](const Candidate& c) {
    return c.shows_place != nullptr && std::string(c.name) == "cam_obstruction";
  });
  REQUIRE(cam != all.end());
  const std::vector<double> at{50.0, 2.0, 1.0};  // position, band, ratio
  CHECK(cam->shows_place(at, std::vector<double>{50.0, 60.0, 50.0, 40.0, 50.0}));
  CHECK_FALSE(cam->shows_place(at, std::vector<double>{50.0, 60.0, 50.0}));
  CHECK_FALSE(cam->shows_place(at, std::vector<double>{48.0, 52.0, 47.0, 53.0, 48.0}));
  CHECK_FALSE(cam->shows_place(at, std::vector<double>{60.0, 40.0, 50.0, 40.0}));
}

}  // namespace candidate_test
