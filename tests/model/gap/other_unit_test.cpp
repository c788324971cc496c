// SPDX-License-Identifier: Apache-2.0
// Units other than the model's are distinguished from effects that scale a signal.
#include "model/gap/other_unit.hpp"

#include <catch2/catch.hpp>

#include "tests/model/gap/gap_support.hpp"

namespace loopwarden::tests::other_unit_test {
namespace {

using gap::SignalUnit;

const SignalUnit kSame{"", 0.0, 10.0};  // both ranges of the model

// Returns the record as a logger in these units would have written it.
numeric::LoopRecord written(numeric::LoopRecord r, const SignalUnit& pv, const SignalUnit& co) {
  const auto convert = [](std::vector<double>& column, const SignalUnit& to) {
    for (double& v : column) v = to.low + v * (to.high - to.low) / 10.0;
  };
  convert(r.pv, pv);
  convert(r.sp, pv);
  convert(r.co, co);
  return r;
}

plant::LoopModel sticky_model() {
  plant::LoopModel model = test::believed_model();
  model.valve_effects.push_back({"stiction", {{"s", 0.5}, {"j", 0.2}}});
  return model;
}

}  // namespace

TEST_CASE("a record in another unit is reported, also if the valve sticks", "[gap]") {
  const plant::LoopModel model = test::believed_model();
  for (const plant::LoopModel& truth : {model, sticky_model()}) {
    const numeric::LoopRecord record = test::record_of(truth, 130.0);
    CHECK_FALSE(gap::other_unit(record, model));
    for (const SignalUnit& unit :
         {SignalUnit{"% of the PV range", 0.0, 100.0}, SignalUnit{"thousandths", 0.0, 1e4},
          SignalUnit{"a share of the PV range", 0.0, 1.0}, SignalUnit{"kelvin", 273.15, 283.15},
          SignalUnit{"", 0.0, 36.0}}) {
      INFO(unit.high);
      const auto found = gap::other_unit(written(record, unit, kSame), model);
      REQUIRE(found);
      CHECK(found->co.name.empty());
      CHECK(found->pv.low == Approx(unit.low));
      CHECK(found->pv.high == Approx(unit.high));
      CHECK(found->rmse_converted < 0.3 * found->rmse_as_it_stands);
    }
    for (const SignalUnit& unit : {SignalUnit{"", 0.0, 1.0}, SignalUnit{"", 4.0, 20.0}}) {
      INFO(unit.high);
      const auto found = gap::other_unit(written(record, kSame, unit), model);
      REQUIRE(found);
      CHECK(found->pv.name.empty());
      CHECK(found->co.low == Approx(unit.low));
      CHECK(found->co.high == Approx(unit.high));
    }
    const auto both = gap::other_unit(written(record, {"", 0.0, 100.0}, {"", 0.0, 1.0}), model);
    REQUIRE(both);
    CHECK(both->pv.high == Approx(100.0));
    CHECK(both->co.high == Approx(1.0));
  }
}

TEST_CASE("a gain or settings that changed by a round factor are no unit", "[gap]") {
  const plant::LoopModel model = test::believed_model();
  plant::LoopModel weaker = model;
  weaker.process.gain *= 3.6 / 2.0;
  CHECK_FALSE(gap::other_unit(test::record_of(weaker, 130.0), model));
  plant::LoopModel slower = model;
  slower.controller.pid.gains.kp /= 10.0;
  slower.controller.pid.gains.ki /= 10.0;
  CHECK_FALSE(gap::other_unit(test::record_of(slower, 130.0), model));
}

TEST_CASE("without a set point, a unit needs a value out of the range as evidence", "[gap]") {
  const plant::LoopModel model = test::believed_model();
  numeric::LoopRecord record = test::record_of(model, 130.0);
  record.sp.clear();
  CHECK_FALSE(gap::other_unit(record, model));
  const auto found = gap::other_unit(written(record, {"", 0.0, 100.0}, kSame), model);
  REQUIRE(found);
  CHECK(found->pv.high == Approx(100.0));
  plant::LoopModel weaker = model;
  weaker.process.gain /= 2.0;
  numeric::LoopRecord low = test::record_of(weaker, 130.0);
  low.sp.clear();
  CHECK_FALSE(gap::other_unit(low, model));
  record.co.clear();
  CHECK_FALSE(gap::other_unit(record, model));
}

TEST_CASE("a conversion is reversible", "[gap]") {
  const plant::LoopModel model = test::believed_model();
  const numeric::LoopRecord record = test::record_of(model, 20.0);
  const SignalUnit kelvin{"", 273.15, 283.15};
  const SignalUnit current{"", 4.0, 20.0};
  const numeric::LoopRecord back =
      gap::in_models_units(written(record, kelvin, current), model, kelvin, current);
  for (std::size_t k = 0; k < record.size(); ++k) {
    CHECK(back.pv[k] == Approx(record.pv[k]));
    CHECK(back.co[k] == Approx(record.co[k]));
  }
}

}  // namespace loopwarden::tests::other_unit_test
