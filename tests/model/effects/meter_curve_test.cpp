// SPDX-License-Identifier: Apache-2.0
#include "model/effects/meter_curve/meter_curve.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "model/effects/catalogue.hpp"
#include "model/gap/model_run.hpp"
#include "tests/model/effects/search_support.hpp"

namespace meter_curve_test {

using namespace loopwarden;
using effects::MeterCurve;

TEST_CASE("root and square between the ends of the range, by their share",
          "[effects][meter_curve]") {
  MeterCurve root({.curve = MeterCurve::Curve::root}, 10.0, 110.0);
  CHECK(root.step(10.0) == Approx(10.0));
  CHECK(root.step(35.0) == Approx(60.0));
  CHECK(root.step(110.0) == Approx(110.0));
  CHECK(root.step(10.05) == Approx(10.0 + 0.05 / std::sqrt(1e-3)));  // straight at the low end
  MeterCurve square({.curve = MeterCurve::Curve::square, .share = 0.5}, 0.0, 10.0);
  CHECK(square.step(5.0) == Approx(0.5 * 5.0 + 0.5 * 2.5));
  square.set_severity(0.5);
  CHECK(square.step(5.0) == Approx(5.0 - 0.25 * 2.5));
  square.set_severity(0.0);
  CHECK(square.step(5.0) == 5.0);
}

TEST_CASE("a table continues with its end slopes and ignores a share", "[effects][meter_curve]") {
  MeterCurve table({.curve = MeterCurve::Curve::table,
                    .points = {{{0.0, 0.0}, {4.0, 6.0}, {10.0, 10.0}}},
                    .point_count = 3},
                   0.0, 10.0);
  CHECK(table.step(2.0) == Approx(3.0));
  CHECK(table.step(7.0) == Approx(8.0));
  CHECK(table.step(13.0) == Approx(12.0));
  effects::EffectSpec spec{.name = "meter_curve", .options = {{"curve", "table"}}};
  spec.table = {{0.0, 1.0}, {4.0, 0.5}};
  CHECK_THROWS_WITH(effects::check_effect(spec, effects::Block::transmitter, {}),
                    Catch::Contains("must rise in both columns"));
}

TEST_CASE("a forgotten root is found with its share, and is no characteristic of the valve",
          "[effects][meter_curve]") {
  plant::LoopModel truth = test::believed_model();
  truth.transmitter_effects = {{"meter_curve", {{"share", 0.6}}, {{"curve", "square"}}}};
  const test::Named named = test::named_among(
      {"meter_curve", "valve_characteristic", "gain_change", "output_bias"}, truth);
  CHECK(named.first == "meter_curve");
  CHECK(named.lead_nats > 20.0);
  REQUIRE(named.corrected.transmitter_effects.size() == 1);
  const effects::EffectSpec& spec = named.corrected.transmitter_effects[0];
  CHECK(spec.options.at("curve") == "square");
  CHECK(spec.parameters.at("share") == Approx(0.6).epsilon(0.1));
}

TEST_CASE("a model that has the curve fits the record of such a loop from its first sample",
          "[effects][meter_curve]") {
  plant::LoopModel truth = test::believed_model();
  truth.transmitter_effects = {{"meter_curve", {{"share", 0.8}}, {{"curve", "root"}}}};
  truth.scenario.set_point = {{0.0, 3.0}, {10.0, 5.0}, {35.0, 6.5}};
  const numeric::LoopRecord record = test::run_of(truth, 60.0);
  const std::vector<bool> measured(record.size(), true);
  const std::vector<double> pv = gap::free_run(truth, record.co, record.pv, measured);
  CHECK(gap::rms_between(record.pv, pv, measured, {0, record.size()}) < 1e-3);
}

}  // namespace meter_curve_test
