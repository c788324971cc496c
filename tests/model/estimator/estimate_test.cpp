// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/estimate.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "model/effects/catalogue.hpp"
#include "tests/model/estimator/estimator_support.hpp"

namespace estimate_test {

using namespace loopwarden;
using namespace loopwarden::estimator;
using estimator_test::in_order;
using estimator_test::names_of;

namespace {

// Every name but these, so that a test takes a tenth of the time.
Options only(const std::vector<std::string>& names) {
  Options options;
  for (const effects::Descriptor& effect : effects::effect_catalogue()) {
    if (std::find(names.begin(), names.end(), effect.name) == names.end()) {
      options.without.emplace_back(effect.name);
    }
  }
  return options;
}

const std::vector<std::string> kFew{"backlash", "gain_change", "step_disturbance"};

Observed record_of(const plant::LoopModel& truth) {
  return estimator_test::record_of(truth, estimator_test::moving_output(1800));
}

}  // namespace

TEST_CASE("a healthy record lacks no effect", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  const Estimate e = estimate(record_of(model), model, only(kFew), in_order);
  CHECK(e.verdict == Verdict::no_gap);
  CHECK(e.effects.empty());
}

TEST_CASE("one effect is named, with an interval that contains it", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  // A stem with momentum and the friction of a healthy valve.
  truth.valve_effects = {{"stiction",
                          {{"s", 0.01}, {"j", 0.0}, {"natural_frequency", 12.0}, {"damping", 0.7}},
                          {{"law", "inertial"}}},
                         {"backlash", {{"deadband", 0.6}}}};
  const Estimate e = estimate(record_of(truth), model, only(kFew), in_order);
  REQUIRE(names_of(e) == "backlash");
  const Interval& deadband = e.effects[0].intervals.at("deadband");
  CHECK(deadband.within[0] < 0.6);
  CHECK(deadband.within[1] > 0.6);
  CHECK(deadband.within[1] - deadband.within[0] < 0.3);
  CHECK(e.after.holdout < 1.3 * e.noise_rms);
  double sum = 0.0;
  for (const auto& [names, probability] : e.posterior) sum += probability;
  CHECK(sum == Approx(1.0));
}

TEST_CASE("two effects are named together", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  truth.valve_effects = {{"backlash", {{"deadband", 0.6}}}};
  truth.disturbances = {{"step_disturbance", {{"size", 0.5}, {"time", 70.0}}}};
  const Estimate e = estimate(record_of(truth), model, only(kFew), in_order);
  CHECK(names_of(e) == "backlash+step_disturbance");
}

TEST_CASE("the answer has the same bits in any order of the work", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  truth.process_effects = {{"gain_change", {{"factor", 1.3}}}};
  const Observed record = record_of(truth);
  const Estimate a = estimate(record, model, only(kFew), in_order);
  const Estimate b = estimate(record, model, only(kFew), estimator_test::in_reverse);
  CHECK(names_of(a) == "gain_change");
  CHECK(a.pv_after == b.pv_after);
  CHECK(a.posterior == b.posterior);
}

// PV, CO and time in other units, with a model in these units.
TEST_CASE("the answer does not depend on units", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  truth.valve_effects = {{"backlash", {{"deadband", 0.6}}}};
  const Observed record = record_of(truth);
  const double by_pv = 8.0, by_co = 10.0, by_time = 4.0;
  Observed other = record;
  for (double& v : other.pv) v *= by_pv;
  for (double& v : other.co) v *= by_co;
  other.period_s *= by_time;
  plant::LoopModel scaled = model;
  scaled.sample_time_s *= by_time;
  scaled.controller.pid.output_high *= by_co;
  scaled.process.gain *= by_pv / by_co;
  scaled.process.time_constant_s *= by_time;
  scaled.process.dead_time_s *= by_time;
  scaled.transmitter.high *= by_pv;
  const Estimate a = estimate(record, model, only({"backlash", "gain_change"}), in_order);
  const Estimate b = estimate(other, scaled, only({"backlash", "gain_change"}), in_order);
  REQUIRE(names_of(a) == "backlash");
  REQUIRE(names_of(b) == "backlash");
  CHECK(b.effects[0].spec.parameters.at("deadband") ==
        Approx(by_co * a.effects[0].spec.parameters.at("deadband")).epsilon(0.05));
  CHECK(b.after.holdout == Approx(by_pv * a.after.holdout).epsilon(0.02));
}

}  // namespace estimate_test
