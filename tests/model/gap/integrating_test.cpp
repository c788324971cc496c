// SPDX-License-Identifier: Apache-2.0
// The gap workflow on processes that are not one lag and dead time.
#include <catch2/catch.hpp>

#include "model/gap/workflow.hpp"
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

gap::Result gap_of(const plant::LoopModel& model, const gap::Record& record) {
  return gap::find_gap(record, model, {}, test::serial, [](double) {});
}

}  // namespace

TEST_CASE("the free run of an integrating model follows its own record",
          "[gap][integrating][long]") {
  const plant::LoopModel model = level_loop();
  const gap::Result result = gap_of(model, test::record_of(model, 135.0));
  REQUIRE(result.check.usable);
  CHECK(result.verdict == gap::Verdict::no_gap);
  CHECK(result.before.holdout_fit_percent > 90.0);
  CHECK(result.corrected.process.integrating());
}

TEST_CASE("the free run of a model with a second lag follows its own record",
          "[gap][integrating][long]") {
  plant::LoopModel model = test::believed_model();
  model.process.second_time_constant_s = 1.2;
  const gap::Result result = gap_of(model, test::record_of(model, 135.0));
  REQUIRE(result.check.usable);
  CHECK(result.verdict == gap::Verdict::no_gap);
  CHECK(result.corrected.process.second_time_constant_s == 1.2);
}

}  // namespace integrating_gap_test
