// SPDX-License-Identifier: Apache-2.0
// The gap workflow on processes that are not one lag and dead time.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "model/gap/workflow.hpp"
#include "tests/model/gap/few_names.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace integrating_gap_test {

using namespace loopwarden;

namespace {

plant::LoopModel level_loop() {
  plant::LoopModel model = test::believed_model();
  model.controller.pid.gains.kp = 2.0;
  model.controller.pid.gains.ki = 0.1;
  model.process = {.gain = 0.12, .dead_time_s = 0.8, .second_time_constant_s = 0.6};
  model.process.kind = plant::ProcessKind::integrating;
  return model;
}

gap::Result gap_of(const plant::LoopModel& model, const numeric::LoopRecord& record) {
  return gap::find_gap(record, model, {}, test::serial, [](double) {});
}

}  // namespace

TEST_CASE("the free run of an integrating model follows its own record",
          "[gap][integrating][long]") {
  const plant::LoopModel model = level_loop();
  const gap::Result result = gap_of(model, test::record_of(model, 135.0));
  REQUIRE(result.check.usable);
  CHECK(result.outcome == gap::Outcome::no_gap);
  // Down to the noise of record_of(): level and balance are fitted to the whole first part.
  CHECK(result.before.holdout_rmse < 1.3 * 0.015);
  CHECK(result.corrected.process.integrating());
}

TEST_CASE("an effect on an integrating process is named", "[gap][integrating][long]") {
  const plant::LoopModel model = level_loop();
  plant::LoopModel truth = model;
  std::string hidden;
  SECTION("a dead time far beyond the one that is known") {
    hidden = "extra_dead_time";
    truth.process_effects = {{"extra_dead_time", {{"seconds", 2.5}}}};
    truth.controller.pid.gains.kp = 1.0;
  }
  SECTION("a gain") {
    hidden = "gain_change";
    truth.process_effects = {{"gain_change", {{"factor", 1.4}}}};
  }
  SECTION("a valve that sticks") {
    hidden = "stiction";
    truth.valve_effects = {{"stiction", {{"s", 1.0}, {"j", 0.5}}}};
  }
  plant::LoopModel believed = model;
  believed.controller = truth.controller;
  const gap::Result result =
      gap::find_gap(test::record_of(truth, 135.0), believed,
                    test::options_among(test::kLikely, true), test::serial, [](double) {});
  REQUIRE(result.check.usable);
  CAPTURE(result.sentence);
  REQUIRE(result.effects.size() == 1);
  CHECK(result.effects[0].spec.name == hidden);
}

TEST_CASE("the free run of a model with a second lag follows its own record",
          "[gap][integrating][long]") {
  plant::LoopModel model = test::believed_model();
  model.process.second_time_constant_s = 1.2;
  const gap::Result result = gap_of(model, test::record_of(model, 135.0));
  REQUIRE(result.check.usable);
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(result.corrected.process.second_time_constant_s == 1.2);
}

TEST_CASE("two lags forget how the record began as slowly as the slower of them",
          "[gap][integrating][long]") {
  plant::LoopModel model = test::believed_model();
  model.process.time_constant_s = 0.6;
  model.process.second_time_constant_s = 6.0;
  // Begins in the middle of a move.
  numeric::LoopRecord record = test::record_of(model, 135.0);
  const auto cut = [](std::vector<double>& column) {
    column.erase(column.begin(), column.begin() + 130);
  };
  cut(record.pv);
  cut(record.sp);
  cut(record.co);
  const gap::Result result = gap_of(model, record);
  REQUIRE(result.check.usable);
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(result.before.training_rmse < 1.6 * 0.015);
}

}  // namespace integrating_gap_test
