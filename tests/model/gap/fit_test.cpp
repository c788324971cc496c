// SPDX-License-Identifier: Apache-2.0
#include "model/gap/fit.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "model/gap/workflow.hpp"
#include "model/gap/fit_model.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace fit_test {

using namespace loopwarden;

namespace {

struct Setup {
  plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record;
  gap::FreeRun run;
  gap::Fitter fitter;
  std::vector<gap::Candidate> all;

  explicit Setup(const plant::LoopModel& truth, bool allowances = true)
      : record(test::record_of(truth, 130.0)),
        run(model, record.co),
        fitter(run, record.pv, std::vector<bool>(record.size(), true), {.load = 0.3}, allowances),
        all(effects::candidates({.output_low = 0.0,
                                 .output_high = 10.0,
                                 .output_used_low = 2.0,
                                 .output_used_high = 7.0,
                                 .period_s = 0.1,
                                 .duration_s = 130.0,
                                 .time_constant_s = 2.0,
                                 .dead_time_s = 0.8})) {}

  gap::Fit with(const std::string& name) {
    const auto it = std::find_if(all.begin(), all.end(),
                                 [&](const gap::Candidate& c) { return c.name == name; });
    return fitter.settle(fitter.approach(fitter.fit_model(), *it));
  }
};

}  // namespace

TEST_CASE("a changed gain is found, and the model's own gain stays in its bounds", "[gap][fit]") {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 1.25;
  Setup setup(truth);
  const gap::Fit alone = setup.fitter.fit_model();
  CHECK(alone.solved[0] <= 1.03 + 1e-9);
  const gap::Fit fit = setup.with("gain_change");
  CHECK(fit.solved[0] == Approx(1.25).epsilon(0.01));
  CHECK(fit.deviance < alone.deviance - 100.0);
  CHECK(fit.noise_rms == Approx(0.015).epsilon(0.1));
}

TEST_CASE("more dead time is found, within what the allowances hide", "[gap][fit]") {
  plant::LoopModel truth = test::believed_model();
  truth.process_effects = {{"extra_dead_time", {{"seconds", 0.7}}}};
  {
    Setup setup(truth, false);
    const gap::Fit fit = setup.with("extra_dead_time");
    const double found = fit.point.searched[0][0];
    // 3 % and half a period may belong to the model's own dead time; the sum is exact.
    CHECK(found == Approx(0.7).margin(0.1));
    CHECK(found + fit.point.dead_time_s == Approx(1.5).margin(0.02));
  }
  // The momentum of a healthy valve also delays, by up to one or two tenths of a second.
  Setup setup(truth);
  const gap::Fit fit = setup.with("extra_dead_time");
  CHECK(fit.point.searched[0][0] == Approx(0.7).margin(0.2));
  const std::vector<double> spread = setup.fitter.spread(fit, 0);
  REQUIRE(spread.size() == 1);
  CHECK(std::abs(fit.point.searched[0][0] - 0.7) < 3.0 * spread[0]);
}

TEST_CASE("the process stays within the model's uncertainty, whatever is missing", "[gap][fit]") {
  plant::LoopModel truth = test::believed_model();
  truth.process = {.gain = 1.4, .time_constant_s = 3.0, .dead_time_s = 1.3};
  Setup setup(truth);
  for (const gap::Fit& fit :
       {setup.fitter.fit_model(), setup.with("output_bias"), setup.with("extra_lag")}) {
    CHECK(fit.solved[0] <= 1.03 + 1e-9);
    CHECK(fit.point.time_constant_s <= 2.0 * 1.06 + 1e-9);
    CHECK(fit.point.dead_time_s <= 0.8 * 1.03 + 0.05 + 1e-9);  // half a period in addition
    CHECK(fit.point.friction <= gap::Fitter::kHealthyFriction * 10.0 + 1e-12);
  }
}

TEST_CASE("a wandering load is no noise, and one that is too large shows at the limit",
          "[gap][fit]") {
  plant::LoopModel truth = test::believed_model();
  Setup quiet(truth);
  const gap::Fit without = quiet.fitter.fit_model();
  CHECK(quiet.fitter.load_ratio(without) < 0.05);
  CHECK_FALSE(quiet.fitter.load_at_limit(without));
  // 0.1 and 2 times the noise in one period; up to 0.3 is allowed.
  truth.disturbances = {{"random_load", {{"intensity", 0.1 * 0.015 / std::sqrt(0.1)}}}};
  Setup wandering(truth);
  const double ratio = wandering.fitter.load_ratio(wandering.fitter.fit_model());
  CHECK(ratio > 0.05);
  CHECK(ratio < 0.2);
  truth.disturbances[0].parameters["intensity"] *= 20.0;
  Setup wild(truth);
  CHECK(wild.fitter.load_at_limit(wild.fitter.fit_model()));
}

TEST_CASE("an error that a healthy valve leaves for seconds is not taken for a load",
          "[gap][fit]") {
  Setup setup(test::believed_model());
  loopwarden::numeric::Random random(31);
  const double keep = std::exp(-0.1 / 1.5);  // forgotten in 1.5 s
  double left = 0.0;
  for (double& v : setup.record.pv) {
    left = keep * left + 0.02 * std::sqrt(1.0 - keep * keep) * random.normal();
    v += left;
  }
  const std::vector<bool> used(setup.record.size(), true);
  const auto load_beside = [&](double valve) {
    const gap::Fitter fitter(setup.run, setup.record.pv, used, {.load = 0.3, .valve = valve}, true);
    return fitter.load_ratio(fitter.fit_model());
  };
  CHECK(load_beside(0.0) > 0.1);  // only the load can whiten it
  CHECK(load_beside(2.0) < 0.02);
}

TEST_CASE("play between stem and plug is found in its size", "[gap][fit]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"backlash", {{"deadband", 0.8}}}};
  Setup setup(truth);
  const gap::Fit fit = setup.with("backlash");
  CHECK(fit.point.searched[0][0] == Approx(0.8).epsilon(0.08));
  CHECK(std::abs(fit.solved[0] - 1.0) <= 0.03 + 1e-9);
  // Removing the term again restores the model.
  const gap::Fit less = setup.fitter.fit_without(fit, 0, 100);
  CHECK(less.terms.empty());
  CHECK(less.deviance > fit.deviance + 100.0);
}

TEST_CASE("a sticking stem is found in its size", "[gap][fit]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"stiction",
                          {{"s", 1.0}, {"j", 0.5}, {"natural_frequency", 8.0}, {"damping", 0.3}},
                          {{"law", "inertial"}}}};
  Setup setup(truth);
  const gap::Fit fit = setup.with("stiction");
  const double s = fit.point.searched[0][0];
  CHECK(s * (1.0 + fit.point.searched[0][1]) / 2.0 == Approx(0.75).epsilon(0.1));
}

TEST_CASE("the corrected model runs as the fit did", "[gap][fit]") {
  plant::LoopModel truth = test::believed_model();
  truth.process_effects = {{"extra_lag", {{"time_constant", 1.5}}}};
  truth.transmitter_effects = {{"output_bias", {{"bias", 0.4}}}};
  Setup setup(truth);
  gap::Fit fit = setup.with("extra_lag");
  fit.point.actuator_frequency = 0.0;  // the healthy valve's allowances are not part of the model
  const auto bias = std::find_if(setup.all.begin(), setup.all.end(), [](const gap::Candidate& c) {
    return c.name == std::string("output_bias");
  });
  fit.terms.push_back(&*bias);
  fit.point.searched.emplace_back();
  fit.solved = {1.01, 0.0, 0.0, 0.4};
  const std::vector<double> expected = setup.fitter.simulate(fit);
  const plant::LoopModel corrected = setup.run.corrected(fit.terms, fit.point, fit.solved);
  plant::Plant plant(corrected, 1);
  plant.reset(setup.record.co[0]);
  for (std::size_t k = 0; k < expected.size(); ++k) {
    REQUIRE(plant.process_variable() == Approx(expected[k]).margin(1e-9));
    plant.step(setup.record.co[k]);
  }
}

TEST_CASE("an effect moves PV by 0.15 % of its span and by half the noise at least", "[gap][fit]") {
  const plant::LoopModel model = test::believed_model();
  const numeric::LoopRecord record = test::record_of(model, 60.0);
  const auto least = [&](double noise) {
    gap::CheckedRecord checked = gap::check(record, model);
    checked.quality.noise_rms = noise;
    return gap::ModelFit(checked, {}, 0.0).least_rms;
  };
  CHECK(least(0.001) == Approx(0.015));
  CHECK(least(0.2) == Approx(0.1));
}

}  // namespace fit_test
