// SPDX-License-Identifier: Apache-2.0
#include "model/effects/intermittent_stiction/intermittent_stiction.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "tests/model/effects/search_support.hpp"

namespace intermittent_stiction_test {

using namespace loopwarden;

TEST_CASE("the stem is free outside its stretch and sticks as usual inside",
          "[effects][intermittent_stiction]") {
  effects::IntermittentStiction valve({1.2, 0.4}, 10.0, 20.0);
  effects::StictionChoudhury always({1.2, 0.4});
  valve.reset(5.0);
  double stood = 0.0;  // samples of the stretch in which CO moved and the stem did not
  double last_x = 5.0;
  for (int k = 0; k < 300; ++k) {
    const double t = 0.1 * k;
    const double u = 5.0 + 1.5 * std::sin(0.9 * t);
    const double x = valve.step(u, t);
    if (t < 10.0 || t >= 20.0) {
      CHECK(x == u);
      always.reset(u);
    } else {
      CHECK(x == always.step(u));
      if (x == last_x) ++stood;
    }
    last_x = x;
  }
  CHECK(stood > 20.0);
}

TEST_CASE("a stretch needs an end after its beginning, and j at most s",
          "[effects][intermittent_stiction]") {
  const auto valve = [](double j, double from, double to) {
    effects::check_effect(
        {"intermittent_stiction", {{"s", 1.0}, {"j", j}, {"from", from}, {"to", to}}},
        effects::Block::valve, {});
  };
  CHECK_NOTHROW(valve(1.0, 5.0, 6.0));
  CHECK_THROWS_WITH(valve(0.5, 6.0, 5.0), "to must be after from = 6 s (got 5)");
  CHECK_THROWS_WITH(valve(1.5, 5.0, 6.0), "j must be at most s = 1 CO units (got 1.5)");
}

TEST_CASE("the stretch is found, and stiction that stays keeps its name",
          "[effects][intermittent_stiction]") {
  const std::vector<std::string> names{"intermittent_stiction", "stiction", "backlash"};
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {
      {"intermittent_stiction", {{"s", 1.5}, {"j", 0.5}, {"from", 30.0}, {"to", 80.0}}}};
  const test::Named named = test::named_among(names, truth);
  CHECK(named.first == "intermittent_stiction");
  CHECK(named.lead_nats > 6.0);
  truth.valve_effects = {{"stiction", {{"s", 1.0}, {"j", 0.4}}}};
  CHECK(test::named_among(names, truth).first == "stiction");
}

}  // namespace intermittent_stiction_test
