// SPDX-License-Identifier: Apache-2.0
// Records with another sample time than the model's.
#include "model/gap/sample_time.hpp"

#include <catch2/catch.hpp>

#include "tests/model/gap/gap_support.hpp"

namespace loopwarden::tests::sample_time_test {
namespace {

numeric::LoopRecord every_other(const numeric::LoopRecord& record) {
  numeric::LoopRecord out{.period_s = 2.0 * record.period_s, .pv = {}, .sp = {}, .co = {}};
  for (std::size_t k = 0; k < record.size(); k += 2) {
    out.pv.push_back(record.pv[k]);
    out.sp.push_back(record.sp[k]);
    out.co.push_back(record.co[k]);
  }
  return out;
}

gap::Result find(const gap::OnePeriod& one, const plant::LoopModel& model, double period_s) {
  gap::Options options;
  options.search.without = {"controller_mismatch"};
  gap::Result result = gap::find_gap(one.record, one.model, options, test::serial, [](double) {});
  gap::say_other_period(result, model, period_s);
  return result;
}

}  // namespace

TEST_CASE("a slower record keeps its samples, a faster one gives every n-th", "[gap]") {
  plant::LoopModel model = test::believed_model();
  const numeric::LoopRecord slow{
      .period_s = 0.3, .pv = {1, 2, 3}, .sp = {4, 5, 6}, .co = {0, 3, 3}};
  CHECK(gap::on_one_period(slow, model, false)->record.co == slow.co);
  const auto slower = gap::on_one_period(slow, model, true);
  REQUIRE(slower);
  CHECK(slower->model.sample_time_s == 0.3);
  CHECK(slower->record.pv == slow.pv);
  CHECK(slower->record.co[0] == Approx(1.0));  // the mean of 0, 1 and 2
  CHECK(slower->record.co[1] == 3.0);
  CHECK(slower->record.co[2] == 3.0);

  const numeric::LoopRecord fast{
      .period_s = 0.05, .pv = {1, 2, 3, 4, 5}, .sp = {1, 1, 2, 2, 3}, .co = {0, 2, 4, 6, 8}};
  const auto faster = gap::on_one_period(fast, model, false);
  REQUIRE(faster);
  CHECK(faster->record.period_s == 0.1);
  CHECK(faster->record.pv == std::vector<double>{1, 3, 5});
  CHECK(faster->record.co == std::vector<double>{1, 5, 8});

  CHECK_FALSE(gap::on_one_period({.period_s = 0.1, .pv = {}, .sp = {}, .co = {}}, model, false));
  const numeric::LoopRecord uneven{.period_s = 0.25, .pv = {1, 2}, .sp = {}, .co = {3, 4}};
  CHECK_FALSE(gap::on_one_period(uneven, model, false));
  numeric::LoopRecord stored = uneven;
  stored.pv_as_stored = true;
  const auto every = gap::on_one_period(stored, model, false);
  REQUIRE(every);
  CHECK(every->model.sample_time_s == 0.25);
  CHECK(every->record.pv == stored.pv);
  CHECK(every->record.co == stored.co);
}

TEST_CASE("every other sample of a loop that matches its model has no gap", "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  const auto one = gap::on_one_period(every_other(test::record_of(model, 130.0)), model, true);
  REQUIRE(one);
  const gap::Result result = find(*one, model, 0.2);
  CHECK(result.outcome == gap::Outcome::no_gap);
  CHECK(result.corrected == model);
}

TEST_CASE("every other sample of a sticking valve still shows it, with less confidence",
          "[gap][long]") {
  const plant::LoopModel model = test::believed_model();
  plant::LoopModel truth = model;
  truth.valve_effects = {{"stiction", {{"s", 1.0}, {"j", 0.5}}}};
  const auto one = gap::on_one_period(every_other(test::record_of(truth, 200.0)), model, true);
  REQUIRE(one);
  const gap::Result result = find(*one, model, 0.2);
  REQUIRE(result.outcome == gap::Outcome::missing_effect);
  CHECK(result.effects[0].spec.name == "stiction");
  CHECK(result.effects[0].spec.parameters.at("s") == Approx(1.0).epsilon(0.2));
  CHECK(result.effects[0].confidence <= 0.85);
  CHECK(result.corrected.sample_time_s == model.sample_time_s);
}

}  // namespace loopwarden::tests::sample_time_test
