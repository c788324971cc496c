// SPDX-License-Identifier: Apache-2.0
// The process of a model, its characteristic and its healthy friction, fitted to a record.
#include "model/twin/process_fit.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/model/gap/gap_support.hpp"

namespace process_fit_test {

using namespace loopwarden;

namespace {

twin::FittedRecord fitted(const plant::LoopModel& truth) {
  const numeric::LoopRecord record = test::record_of(truth, 400.0);
  return {
      .observed = {record.period_s, record.co, record.pv, std::vector<bool>(record.size(), true)},
      .fitted = record.size() * 2 / 3,
      .noise_rms = 0.015};
}

plant::LoopModel off(plant::LoopModel model, double gain, double times) {
  model.process.gain *= gain;
  model.process.time_constant_s *= times;
  model.process.dead_time_s *= 2.0 - times;
  return model;
}

}  // namespace

TEST_CASE("the process moves to the plant's, with its covariance", "[commission][process_fit]") {
  const plant::LoopModel truth = test::believed_model();
  const twin::FittedRecord record = fitted(truth);
  const twin::ProcessFit fit = twin::fit_process(record, off(truth, 1.04, 1.1));
  CHECK(fit.model.process.gain == Approx(truth.process.gain).epsilon(0.005));
  CHECK(fit.model.process.time_constant_s == Approx(truth.process.time_constant_s).epsilon(0.03));
  CHECK(fit.model.process.dead_time_s == Approx(truth.process.dead_time_s).margin(0.03));
  CHECK(fit.holdout_rmse == Approx(0.015).epsilon(0.1));
  REQUIRE(fit.posterior.parameters.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(fit.posterior.covariance[i][i] > 0.0);
    CHECK(fit.posterior.covariance[i][i] < 4e-4);
    CHECK(fit.posterior.covariance[i][0] == fit.posterior.covariance[0][i]);
  }
  CHECK(twin::disturbance_of(record, fit.pv) < 0.002);
}

TEST_CASE("a process that is hardly known is searched first", "[commission][process_fit]") {
  const plant::LoopModel truth = test::believed_model();
  const twin::FittedRecord record = fitted(truth);
  plant::LoopModel rough = off(truth, 1.4, 0.5);
  rough.process.dead_time_s = 1.6;
  const twin::ProcessFit fit = twin::fit_process(record, twin::find_process(record, rough));
  CHECK(fit.model.process.gain == Approx(truth.process.gain).epsilon(0.01));
  CHECK(fit.model.process.dead_time_s == Approx(truth.process.dead_time_s).margin(0.05));
}

TEST_CASE("friction of a healthy valve is found if the record shows it",
          "[commission][process_fit]") {
  plant::LoopModel truth = test::believed_model();
  const plant::LoopModel model = truth;
  double percent = 0.0;
  SECTION("a valve without friction") {
    const twin::FittedRecord record = fitted(truth);
    twin::add_friction(record, twin::fit_process(record, model), 0.1, percent);
    CHECK(percent < 0.2);
  }
  SECTION("backlash of 0.6 % of span, beside a disturbance") {
    truth.valve_effects = {{"backlash", {{"deadband", 0.06}}}};
    truth.disturbances = {{"random_load", {{"intensity", 0.005}, {"time_constant", 300.0}}}};
    const twin::FittedRecord record = fitted(truth);
    const twin::ProcessFit plain = twin::fit_process(record, model);
    const twin::ProcessFit fit = twin::add_friction(record, plain, 0.1, percent);
    CHECK(percent == Approx(0.6).margin(0.25));
    REQUIRE(fit.model.valve_effects.size() == 1);
    CHECK(twin::disturbance_of(record, fit.pv) == Approx(0.005).margin(0.004));
    CHECK(twin::add_friction(record, plain, 0.0, percent).model.valve_effects.empty());
  }
}

TEST_CASE("a characteristic is bent to the record, with its points where the loop was",
          "[commission][process_fit]") {
  plant::LoopModel truth = test::believed_model();
  effects::EffectSpec installed{"valve_characteristic", {}, {{"curve", "table"}}};
  for (int i = 0; i <= 15; ++i) {
    const double h = i / 15.0;
    installed.table.emplace_back(10.0 * h, 10.0 * h / std::sqrt(0.15 + 0.85 * h * h));
  }
  truth.valve_effects = {installed};
  const twin::FittedRecord record = fitted(truth);
  const twin::ProcessFit straight = twin::fit_process(record, test::believed_model());
  const twin::ProcessFit fit = twin::bend_characteristic(record, straight);
  CHECK(straight.holdout_rmse > 0.03);
  CHECK(fit.holdout_rmse < 0.02);
  const auto& points = fit.model.valve_effects.at(0).table;
  for (std::size_t i = 1; i < points.size(); ++i) {
    CHECK(points[i].first > points[i - 1].first);
    CHECK(points[i].second > points[i - 1].second);
  }
}

}  // namespace process_fit_test
