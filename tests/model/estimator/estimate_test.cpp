// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/estimate.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "model/effects/catalogue.hpp"
#include "model/numeric/random.hpp"
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

// The same names, and values that differ by less than `share`.
void check_same(const Estimate& a, const Estimate& b, double share) {
  REQUIRE(a.effects.size() == b.effects.size());
  for (std::size_t i = 0; i < a.effects.size(); ++i) {
    CHECK(a.effects[i].spec.name == b.effects[i].spec.name);
    CHECK(a.effects[i].confidence == Approx(b.effects[i].confidence).margin(0.1));
    for (const auto& [name, interval] : a.effects[i].intervals) {
      const Interval& other = b.effects[i].intervals.at(name);
      CHECK(interval.value == Approx(other.value).epsilon(share));
      CHECK(interval.within[0] == Approx(other.within[0]).epsilon(3.0 * share));
      CHECK(interval.within[1] == Approx(other.within[1]).epsilon(3.0 * share));
    }
  }
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
  CHECK(b.after.holdout == Approx(by_pv * a.after.holdout).epsilon(0.05));
}

TEST_CASE("the answer does not depend on rounding", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  truth.valve_effects = {{"backlash", {{"deadband", 0.6}}}};
  const Observed record = record_of(truth);
  Observed other = record;
  numeric::Random random(5);
  for (double& v : other.pv) v *= 1.0 + 1e-12 * random.normal();
  for (double& v : other.co) v *= 1.0 + 1e-12 * random.normal();
  const Options options = only({"backlash", "gain_change"});
  const Estimate a = estimate(record, model, options, in_order);
  const Estimate b = estimate(other, model, options, in_order);
  REQUIRE(names_of(a) == "backlash");
  REQUIRE(names_of(b) == "backlash");
  check_same(a, b, 0.02);
}

TEST_CASE("the answer does not depend on where the record starts", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  truth.process_effects = {{"gain_change", {{"factor", 1.3}}}};
  const Observed record = record_of(truth);
  Observed later = record;
  constexpr std::ptrdiff_t kShift = 37;  // samples
  later.pv.erase(later.pv.begin(), later.pv.begin() + kShift);
  later.co.erase(later.co.begin(), later.co.begin() + kShift);
  later.used.erase(later.used.begin(), later.used.begin() + kShift);
  const Estimate a = estimate(record, model, only(kFew), in_order);
  const Estimate b = estimate(later, model, only(kFew), in_order);
  REQUIRE(names_of(a) == "gain_change");
  REQUIRE(names_of(b) == "gain_change");
  check_same(a, b, 0.05);
}

TEST_CASE("a clipped reading is told from a curve", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  plant::LoopModel truth = model;
  truth.transmitter_effects = {{"clipped_measurement", {{"high", 6.0}}}};
  const Options options = only({"clipped_measurement", "meter_curve", "gain_change"});
  const Estimate clipped = estimate(record_of(truth), model, options, in_order);
  REQUIRE(names_of(clipped) == "clipped_measurement");
  CHECK(clipped.effects[0].spec.parameters.at("high") == Approx(6.0).margin(0.1));
  CHECK(clipped.after.holdout < 1.3 * model.transmitter.noise);

  truth.transmitter_effects = {{"meter_curve", {{"share", 0.6}}, {{"curve", "root"}}}};
  const Estimate bent = estimate(record_of(truth), model, options, in_order);
  REQUIRE(names_of(bent) == "meter_curve");
  CHECK(bent.effects[0].spec.parameters.at("share") == Approx(0.6).epsilon(0.1));
}

TEST_CASE("a stop of the stem is learned, because no name fits", "[estimator][estimate]") {
  const plant::LoopModel model = estimator_test::believed_model();
  const std::vector<double> co = estimator_test::moving_output(1800);
  std::vector<double> stem = co;
  for (double& v : stem) v = std::max(v, 4.0);
  Observed record = estimator_test::record_of(model, stem);
  record.co = co;
  Options options = only({"clipped_measurement", "gain_change", "learned"});
  const Estimate e = estimate(record, model, options, in_order);
  REQUIRE(names_of(e) == "learned");
  CHECK(e.effects[0].description == "stop of the stem");
  options.without.emplace_back("learned");
  CHECK(estimate(record, model, options, in_order).verdict == Verdict::unexplained);
}

}  // namespace estimate_test
