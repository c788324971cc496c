// SPDX-License-Identifier: Apache-2.0
// A CO that the logger wrote late is distinguished from dead time and from a controller that
// computes for a sample.
#include "model/gap/logger.hpp"

#include <catch2/catch.hpp>

#include "model/gap/workflow.hpp"
#include "tests/model/gap/gap_support.hpp"

namespace loopwarden::tests::logger_test {

TEST_CASE("CO that is logged late or early is known by the controller and the plant", "[gap]") {
  const plant::LoopModel model = test::believed_model();
  const numeric::LoopRecord record = test::record_of(model, 130.0);
  for (const int late : {-2, -1, 0, 1, 2, 3}) {
    INFO(late);
    CHECK(gap::logger_shift(gap::with_co_moved_back(record, -late), model) == late);
  }
  numeric::LoopRecord no_set_point = gap::with_co_moved_back(record, -2);
  no_set_point.sp.clear();
  CHECK(gap::logger_shift(no_set_point, model) == 0);
}

TEST_CASE("more dead time, and a controller that computes for a sample, are no logger", "[gap]") {
  const plant::LoopModel model = test::believed_model();
  plant::LoopModel later = model;
  later.process.dead_time_s += 2.0 * model.sample_time_s;
  const numeric::LoopRecord dead = test::record_of(later, 130.0);
  CHECK(gap::logger_shift(dead, model) == 0);
  // The plant answers as the model does to a CO that is logged two samples after its cause.
  CHECK(gap::logger_shift(gap::with_co_moved_back(dead, -2), model) == 0);
}

TEST_CASE("CO that is moved back is taken from the record", "[gap]") {
  numeric::LoopRecord record{.period_s = 1.0, .pv = {}, .sp = {}, .co = {1.0, 2.0, 3.0, 4.0}};
  CHECK(gap::with_co_moved_back(record, 1).co == std::vector<double>{2.0, 3.0, 4.0, 4.0});
  CHECK(gap::with_co_moved_back(record, -2).co == std::vector<double>{1.0, 1.0, 1.0, 2.0});
  CHECK(gap::with_co_moved_back(record, 9).co == std::vector<double>{4.0, 4.0, 4.0, 4.0});
}

TEST_CASE("a late CO is reported and corrected, and no effect is named for it", "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  const numeric::LoopRecord record = gap::with_co_moved_back(test::record_of(model, 130.0), -3);
  const gap::Result result = gap::find_gap(record, model, {}, test::serial, [](double) {});
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(result.effects.empty());
  CHECK(result.sentence.find("CO was logged 3 samples too late") != std::string::npos);
  CHECK(result.before.rmse == Approx(0.015).epsilon(0.2));
}

}  // namespace loopwarden::tests::logger_test
