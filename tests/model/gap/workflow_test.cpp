// SPDX-License-Identifier: Apache-2.0
#include "model/gap/workflow.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "model/gap/model_run.hpp"
#include "tests/model/gap/few_names.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace workflow_test {

using namespace loopwarden;

namespace {

gap::Result find_one(const numeric::LoopRecord& record, const plant::LoopModel& model) {
  return gap::find_gap(record, model, {.search = {.several = false}}, test::serial, [](double) {});
}

gap::Result find(const numeric::LoopRecord& record, const plant::LoopModel& model,
                 const gap::ParallelFor& parallel = test::serial) {
  return gap::find_gap(record, model, {}, parallel, [](double) {});
}

}  // namespace

TEST_CASE("a right model is kept and no effect is named", "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  const gap::Result result = find(test::record_of(model, 130.0), model);
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(result.effects.empty());
  CHECK(result.corrected == model);
  CHECK(result.before.rmse == Approx(0.015).epsilon(0.2));
}

TEST_CASE("a changed gain is named, located and added", "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 0.8;
  const numeric::LoopRecord record = test::record_of(truth, 90.0);
  const plant::LoopModel model = test::believed_model();
  const gap::Result result = find(record, model);
  REQUIRE(result.outcome == gap::Outcome::missing_effect);
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == "gain_change");
  CHECK(result.effects[0].block == effects::Block::process);
  const double factor = result.effects[0].spec.parameters.at("factor");
  CHECK(factor == Approx(0.8).epsilon(0.02));
  const auto& interval = result.effects[0].interval.at("factor");
  CHECK(interval[0] < factor);
  CHECK(factor < interval[1]);
  CHECK(result.after.holdout_rmse < 0.1 * result.before.holdout_rmse);
  REQUIRE(result.steps.size() == 1);
  CHECK(result.steps[0].effect == "gain_change");
  std::map<gap::LocatedBy, double> shares;
  for (const gap::Located& located : result.located) shares[located.by] += located.share_of_gap;
  CHECK(shares.size() == 3);
  for (const auto& [by, share] : shares) CHECK(share == Approx(1.0));
}

TEST_CASE("a held reading is named by its beat, and is the only name", "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.transmitter_effects = {{"held_measurement", {{"interval", 1.3}}}};
  const plant::LoopModel model = test::believed_model();
  const gap::Result result = find(test::record_of(truth, 130.0), model);
  REQUIRE(result.outcome == gap::Outcome::missing_effect);
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec == effects::EffectSpec{"held_measurement", {{"interval", 1.3}}});
  CHECK(result.effects[0].block == effects::Block::transmitter);
  REQUIRE(result.corrected.transmitter_effects.size() == 1);
  CHECK(result.after.rmse < 0.5 * result.before.rmse);
  // 0.015 and the movement of PV in 1.3 s
  CHECK(result.check.noise_rms == Approx(0.02).epsilon(0.3));
  gap::Options without;
  without.search.without = {"held_measurement"};
  const gap::Result unnamed =
      gap::find_gap(test::record_of(truth, 130.0), model, without, test::serial, [](double) {});
  CHECK(unnamed.effects.empty());
  // A model with this effect has no gap.
  const gap::Result known = find(test::record_of(truth, 130.0), truth);
  CHECK(known.outcome == gap::Outcome::no_gap);
}

TEST_CASE("a clipped reading is named, flat or with noise beyond the limit", "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  plant::LoopModel truth = model;
  truth.transmitter_effects = {{"clipped_measurement", {{"high", 5.8}}}};
  numeric::LoopRecord record = test::record_of(truth, 130.0);
  const bool noise_behind = GENERATE(false, true);
  if (noise_behind) {
    numeric::Random random(3);
    for (double& pv : record.pv) {
      if (pv == 5.8) pv += 0.015 * random.normal();
    }
  }
  const gap::Result result = find(record, model);
  REQUIRE(result.outcome == gap::Outcome::missing_effect);
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == "clipped_measurement");
  CHECK(result.effects[0].spec.parameters.at("high") == Approx(5.8).margin(0.01));
  CHECK(result.after.rmse < 0.3 * result.before.rmse);
  REQUIRE(result.corrected.transmitter_effects.size() == 1);
}

TEST_CASE("the end of the transmitter's own range is no fault", "[gap][long]") {
  plant::LoopModel model = test::believed_model();
  model.transmitter.high = 5.8;
  const gap::Result result = find(test::record_of(model, 130.0), model);
  INFO(result.sentence);
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(result.effects.empty());
  // Samples at the limit show no noise, and don't count for it.
  CHECK(result.check.noise_rms == Approx(0.015).epsilon(0.2));
}

TEST_CASE("the result does not depend on the number of threads", "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"backlash", {{"deadband", 0.8}}}};
  const numeric::LoopRecord record = test::record_of(truth, 90.0);
  const auto found = [&](const gap::ParallelFor& parallel) {
    return test::find_among(test::kLikely, record, test::believed_model(), parallel);
  };
  const gap::Result serial = found(test::serial);
  const gap::Result threads =
      found([](std::size_t count, const std::function<void(std::size_t)>& body) {
        std::thread other([&] {
          for (std::size_t i = 1; i < count; i += 2) body(i);
        });
        for (std::size_t i = 0; i < count; i += 2) body(i);
        other.join();
      });
  REQUIRE(serial.effects.size() == 1);
  REQUIRE(threads.effects.size() == 1);
  CHECK(serial.effects[0].spec.name == "backlash");
  CHECK(threads.effects[0].spec == serial.effects[0].spec);
  CHECK(threads.effects[0].confidence == serial.effects[0].confidence);
  CHECK(threads.effects[0].interval == serial.effects[0].interval);
  CHECK(threads.corrected == serial.corrected);
  REQUIRE(threads.candidates.size() == serial.candidates.size());
  for (std::size_t i = 0; i < serial.candidates.size(); ++i) {
    CHECK(threads.candidates[i].name == serial.candidates[i].name);
    CHECK(threads.candidates[i].score == serial.candidates[i].score);
  }
}

TEST_CASE("other units of PV and CO give the same names, powers of two the same bits",
          "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  const bool sticks = GENERATE(true, false);
  if (sticks) {
    truth.valve_effects = {{"stiction", {{"s", 0.9}, {"j", 0.3}}}};
  } else {
    truth.process.gain *= 0.8;
  }
  const numeric::LoopRecord record = test::record_of(truth, 130.0);
  const auto found = [&](double pv_unit, double co_unit) {
    plant::LoopModel model = test::believed_model();
    numeric::LoopRecord scaled = record;
    for (double& v : scaled.pv) v *= pv_unit;
    for (double& v : scaled.sp) v *= pv_unit;
    for (double& v : scaled.co) v *= co_unit;
    model.controller.pid.gains.kp *= co_unit / pv_unit;
    model.controller.pid.gains.ki *= co_unit / pv_unit;
    model.controller.pid.output_low *= co_unit;
    model.controller.pid.output_high *= co_unit;
    model.process.gain *= pv_unit / co_unit;
    model.transmitter.low *= pv_unit;
    model.transmitter.high *= pv_unit;
    return test::find_among(test::kLikely, scaled, model);
  };
  const gap::Result as_it_is = found(1.0, 1.0);
  REQUIRE(as_it_is.effects.size() == 1);
  const gap::Result twos = found(8.0, 0.25);
  const gap::Result others = found(12.0, 10.0);
  const auto& spec = as_it_is.effects[0].spec;
  REQUIRE(twos.effects.size() == 1);
  REQUIRE(others.effects.size() == 1);
  CHECK(twos.effects[0].spec.name == spec.name);
  CHECK(others.effects[0].spec.name == spec.name);
  CHECK(twos.effects[0].confidence == Approx(as_it_is.effects[0].confidence));
  CHECK(twos.after.holdout_rmse == 8.0 * as_it_is.after.holdout_rmse);
  for (const char* name : {"s", "j"}) {
    if (sticks) CHECK(twos.effects[0].spec.parameters.at(name) == 0.25 * spec.parameters.at(name));
  }
  if (!sticks) CHECK(twos.effects[0].spec.parameters == spec.parameters);
}

TEST_CASE("without CO the closed loop is compared", "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 60.0);
  record.co.clear();
  const gap::Result result = find(record, model);
  CHECK(result.closed_loop);
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(std::isfinite(result.before.rmse));
  CHECK(std::isnan(result.controller_before_rmse));
}

TEST_CASE("without CO a changed gain is found from the movement of PV", "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  plant::LoopModel truth = model;
  truth.process.gain *= 0.75;
  numeric::LoopRecord record = test::record_of(truth, 130.0);
  record.co.clear();
  const gap::Result result = find(record, model);
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == "gain_change");
  CHECK(result.effects[0].spec.parameters.at("factor") == Approx(0.75).epsilon(0.04));
  CHECK(result.after.holdout_rmse < 0.5 * result.before.holdout_rmse);
}

TEST_CASE("a refused record has a reason and no verdict", "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 10.0);
  const gap::Result result = find(record, model);
  CHECK_FALSE(result.check.usable);
  CHECK(result.effects.empty());
}

TEST_CASE("a model whose valve sticks starts from the position of the record's valve",
          "[gap][long]") {
  plant::LoopModel model = test::believed_model();
  model.valve_effects = {{"stiction", {{"s", 1.5}, {"j", 0.5}}}};
  numeric::LoopRecord record = test::record_of(model, 120.0);
  // Cut at a moment when the stem rests apart from CO.
  const auto cut = [&](std::vector<double>& column) {
    column.erase(column.begin(), column.begin() + 300);
  };
  cut(record.pv);
  cut(record.sp);
  cut(record.co);
  const std::vector<bool> used(record.size(), true);
  const std::vector<double> pv = gap::free_run(model, record.co, record.pv, used);
  double sum = 0.0;
  for (std::size_t k = 0; k < pv.size(); ++k)
    sum += (pv[k] - record.pv[k]) * (pv[k] - record.pv[k]);
  CHECK(std::sqrt(sum / static_cast<double>(pv.size())) < 0.03);
}

TEST_CASE("a constant CO accuses neither valve nor process", "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  plant::LoopModel truth = model;
  truth.transmitter_effects = {{"output_bias", {{"bias", 0.8}}}};
  numeric::LoopRecord record{
      .period_s = 0.1, .pv = {}, .sp = {}, .co = std::vector<double>(900, 4.0)};
  numeric::Random random(3);
  for (const double v : test::driven(truth, record.co)) {
    record.pv.push_back(v + 0.02 * random.normal());
  }
  const gap::Result result = find(record, model);
  CHECK(result.check.usable);
  for (const gap::FoundEffect& effect : result.effects) {
    CHECK(effect.block != effects::Block::valve);
    CHECK(effect.block != effects::Block::process);
  }
}

TEST_CASE("a process as fast as its sampling is compared like any other", "[gap][long]") {
  plant::LoopModel model = test::believed_model();
  model.process.time_constant_s = GENERATE(0.25, 0.002);
  model.process.dead_time_s = 0.0;
  plant::LoopModel truth = model;
  truth.process.gain *= 1.3;
  const gap::Options one_effect{.search = {.several = false}};
  const gap::Result result =
      gap::find_gap(test::record_of(truth, 60.0), model, one_effect, test::serial, [](double) {});
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == "gain_change");
}

namespace {

// RMS error of the free run of the corrected model over that of PV after the correction.
double corrected_error(const numeric::LoopRecord& record, const gap::Result& result) {
  const std::vector<bool> used(record.size(), true);
  const std::vector<double> pv = gap::free_run(result.corrected, record.co, record.pv, used);
  return gap::rms_between(record.pv, pv, used, {0, record.size()}) / result.after.rmse;
}

}  // namespace

TEST_CASE("the corrected model has the effect and the process as they were fitted", "[gap]") {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 1.02;
  truth.process.dead_time_s *= 1.02;
  truth.process_effects = {{"extra_lag", {{"time_constant", 1.5}}}};
  const numeric::LoopRecord record = test::record_of(truth, 130.0);
  const gap::Result result = test::find_among(test::kLikely, record, test::believed_model());
  REQUIRE(result.outcome == gap::Outcome::missing_effect);
  CHECK(corrected_error(record, result) < 1.2);
}

TEST_CASE("probabilities add up, and the corrected model of a sticking valve gives its PV",
          "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 1.02;
  truth.process.dead_time_s *= 1.02;
  truth.valve_effects = {{"stiction", {{"s", 0.9}, {"j", 0.3}}}};
  truth.controller.pid.gains.kp *= 1.3;
  const numeric::LoopRecord record = test::record_of(truth, 130.0);
  const gap::Result result = find_one(record, test::believed_model());
  REQUIRE(result.effects.size() == 2);  // the controller, too
  double sum = 0.0;
  for (const gap::Probability& h : result.posterior) {
    CHECK(h.probability >= 0.009);
    sum += h.probability;
  }
  CHECK(sum == Approx(1.0));
  for (const gap::FoundEffect& effect : result.effects) {
    double own = 0.0;
    for (const gap::Probability& h : result.posterior) {
      if (std::find(h.effects.begin(), h.effects.end(), effect.spec.name) != h.effects.end()) {
        own += h.probability;
      }
    }
    CHECK(effect.confidence == Approx(own));
    for (const auto& [name, interval] : effect.interval) CHECK(interval[0] >= 0.0);
  }
  CHECK(corrected_error(record, result) < 1.2);
}

TEST_CASE("a record of another period is compared at its own", "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.process.gain *= 0.75;
  numeric::LoopRecord record = test::record_of(truth, 260.0);
  const std::size_t every = 4;
  numeric::LoopRecord slow{.period_s = 0.4};
  for (std::size_t k = 0; k < record.size(); k += every) {
    slow.pv.push_back(record.pv[k]);
    slow.sp.push_back(record.sp[k]);
    slow.co.push_back(record.co[k]);
  }
  const gap::Result result = find_one(slow, test::believed_model());
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == "gain_change");
  CHECK(result.effects[0].confidence <= 0.85);
  CHECK(result.corrected.sample_time_s == test::believed_model().sample_time_s);
  CHECK(std::isnan(result.controller_before_rmse));
}

namespace {

// A loop under a load of 0.1 % of span per root second. Its SP moves every 20 s for `moved_s`.
numeric::LoopRecord under_load(plant::LoopModel truth, double seconds, double moved_s) {
  truth.transmitter.noise = 0.015;
  truth.disturbances.push_back({"random_load", {{"intensity", 0.01}, {"time_constant", 300.0}}});
  truth.scenario.seed = 21;
  numeric::Random random(2);
  for (double t = 0.0; t < moved_s; t += 20.0) {
    truth.scenario.set_point.emplace_back(t, random.uniform(3.5, 6.5));
  }
  return test::run_of(truth, seconds);
}

}  // namespace

TEST_CASE("the truth given as the model under a load leaves no gap to close", "[gap][long]") {
  plant::LoopModel truth = test::believed_model();
  truth.valve_effects = {{"backlash", {{"deadband", 0.8}}}};
  const gap::Result result = find_one(under_load(truth, 200.0, 200.0), truth);
  INFO(result.sentence);
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(result.floor.load_tested);
  CHECK(result.floor.transmitter_rmse == Approx(0.015).epsilon(0.2));
  CHECK(result.floor.load_rmse > 2.0 * result.floor.transmitter_rmse);
  CHECK(result.floor.rmse() > 0.4 * result.before.holdout_rmse);
}

TEST_CASE("a richer effect is not named in place of a simpler one outside the catalogue",
          "[gap][workflow]") {
  plant::LoopModel truth = test::believed_model();
  const plant::LoopModel model = truth;
  SECTION("play is no stiction") {
    truth.valve_effects = {{"backlash", {{"deadband", 0.8}}}};
    const gap::Result known =
        test::find_among({"stiction", "backlash"}, test::record_of(truth, 130.0), model);
    REQUIRE(known.effects.size() == 1);
    CHECK(known.effects[0].spec.name == "backlash");
  }
  SECTION("a different gain does not vary") {
    truth.process.gain *= 0.8;
    CHECK(test::find_among({"varying_gain", "drift"}, test::record_of(truth, 130.0), model)
              .effects.empty());
  }
  SECTION("one more lag has no inverse response, and does not ring") {
    truth.process_effects = {{"extra_lag", {{"time_constant", 1.5}}}};
    for (const char* richer : {"inverse_response", "oscillatory_process", "positioner_overshoot"}) {
      INFO(richer);
      CHECK(test::find_among({richer}, test::record_of(truth, 130.0), model).effects.empty());
    }
  }
  SECTION("a rate limit has no band") {
    truth.valve_effects = {{"low_air_supply", {{"rate", 0.25}}}};
    CHECK(
        test::find_among({"deadband_drive"}, test::record_of(truth, 130.0), model).effects.empty());
  }
}

}  // namespace workflow_test
