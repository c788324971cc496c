// SPDX-License-Identifier: Apache-2.0
// A change of the loop from a moment on, by name and size.
#include "model/estimator/since.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "model/effects/catalogue.hpp"
#include "model/estimator/estimate.hpp"
#include "tests/model/estimator/estimator_support.hpp"

namespace since_test {

using namespace loopwarden;
using namespace loopwarden::estimator;
using effects::Block;
using estimator_test::names_of;

namespace {

constexpr double kAt_s = 80.0;

// A loop that is the model for 80 s, then has an effect. A few names only, so that a test is fast.
Estimate changed(const effects::EffectSpec& spec, Block block,
                 const std::vector<std::string>& names) {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  if (!spec.name.empty()) truth.scenario.faults = {{spec, block, {.from_s = kAt_s}}};
  Options options{.fitted = 1900, .since = Moments{60.0, 100.0}};
  for (const effects::Descriptor& effect : effects::effect_catalogue()) {
    if (std::find(names.begin(), names.end(), effect.name) == names.end()) {
      options.without.emplace_back(effect.name);
    }
  }
  return estimate(estimator_test::record_of(truth, estimator_test::moving_output(2400)), model,
                  options, estimator_test::in_order);
}

}  // namespace

TEST_CASE("a change is named with its size and the moment from which it acts",
          "[estimator][since]") {
  const Estimate e = changed({"gain_change", {{"factor", 1.3}}}, Block::process,
                             {"gain_change", "extra_lag", "step_disturbance"});
  REQUIRE(names_of(e) == "gain_change");
  CHECK(e.effects[0].spec.parameters.at("factor") == Approx(1.3).epsilon(0.02));
  CHECK(e.effects[0].moment.value == Approx(kAt_s).margin(2.0));
  CHECK(e.effects[0].moment.within[0] <= e.effects[0].moment.value);
  CHECK(e.closed > 0.95);
}

TEST_CASE("a bias that begins is a step, and its moment is the step's time", "[estimator][since]") {
  const Estimate e = changed({"output_bias", {{"bias", 0.5}}}, Block::transmitter,
                             {"gain_change", "drift", "output_bias", "step_disturbance"});
  REQUIRE(names_of(e) == "step_disturbance");
  CHECK(e.effects[0].spec.parameters.at("size") == Approx(0.5).margin(0.05));
  CHECK(e.effects[0].spec.parameters.at("time") == Approx(kAt_s).margin(1.0));
}

TEST_CASE("a valve that begins to stick is no change of the process", "[estimator][since]") {
  const Estimate e = changed({"stiction", {{"s", 0.9}, {"j", 0.4}}}, Block::valve,
                             {"gain_change", "extra_lag", "extra_dead_time", "stiction"});
  REQUIRE(names_of(e) == "stiction");
  const Interval& s = e.effects[0].intervals.at("s");
  CHECK(s.within[0] < 0.9);
  CHECK(s.within[1] > 0.9);
}

TEST_CASE("a loop that did not change gets no name", "[estimator][since]") {
  const Estimate e = changed({}, Block::process, {"gain_change", "extra_lag", "stiction"});
  CHECK(e.verdict == Verdict::no_gap);
}

}  // namespace since_test
