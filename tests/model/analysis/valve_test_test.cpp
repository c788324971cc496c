// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/valve_test.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>

#include "model/analysis/condition_index.hpp"
#include "model/analysis/relay_test.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/low_air_supply/low_air_supply.hpp"
#include "model/plant/plant.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"

namespace valve_test_test {

using namespace loopwarden;
using namespace loopwarden::analysis;

namespace {

const ValveTestSettings kSettings{
    .low = 2.0, .high = 8.0, .span = 10.0, .hold_s = 5.0, .sample_time_s = 0.1};

ValveFigures run(ValveTest test, const std::function<double(double)>& valve) {
  std::vector<HeldPosition> holds;
  for (const Hold& hold : plan(test, kSettings)) {
    CHECK(hold.output >= kSettings.low);
    CHECK(hold.output <= kSettings.high);
    HeldPosition held{.output = hold.output, .position = {}};
    const long samples = std::max(1L, std::lround(hold.seconds / kSettings.sample_time_s));
    for (long k = 0; k < samples; ++k) held.position.push_back(valve(hold.output));
    holds.push_back(std::move(held));
  }
  return figures(test, kSettings, holds, 0.005);
}

}  // namespace

// The thesis, chapter 7: the lower the air pressure, the larger the dead band.
TEST_CASE("with less air the signature of a valve is wider, if it moves faster than the air allows",
          "[analysis][valve-test]") {
  const auto scan = [](ValveTest test, double rate) {
    effects::LowAirSupply air({.rate = rate}, kSettings.sample_time_s);
    air.reset(5.0);
    return run(test, [&](double u) { return air.step(u); });
  };
  // The ramp rises by 6 in 50 s, 0.12 per second.
  CHECK(scan(ValveTest::dynamic_scan, 0.3).at("dead_band_percent") < 0.5);
  const double low = scan(ValveTest::dynamic_scan, 0.1).at("dead_band_percent");
  const double lower = scan(ValveTest::dynamic_scan, 0.06).at("dead_band_percent");
  CHECK(low > 2.0);
  CHECK(lower > 2.0 * low);
  // After a long hold the stem arrives. So this is no dead band as in a valve's data sheet.
  CHECK(scan(ValveTest::static_scan, 0.1).at("dead_band_percent") < 0.5);
}

TEST_CASE("valve tests measure the parameters of the simulated valve", "[analysis][valve-test]") {
  const auto ideal = [](double u) { return u; };
  effects::Backlash play(0.15);
  play.reset(5.0);
  const auto backlash = [&](double u) { return play.step(u); };
  CHECK(run(ValveTest::static_scan, ideal).at("dead_band_percent") == Approx(0.0).margin(1e-9));
  CHECK(run(ValveTest::static_scan, backlash).at("dead_band_percent") == Approx(1.5).epsilon(0.02));
  CHECK(run(ValveTest::dynamic_scan, backlash).at("dead_band_percent") ==
        Approx(1.5).epsilon(0.05));
  CHECK(run(ValveTest::dynamic_scan, backlash).at("slope") == Approx(1.0).epsilon(0.02));

  // Backlash has no stick band: the valve continues at once, and reverses only after 1.5 %.
  const ValveFigures study = run(ValveTest::step_study, backlash);
  CHECK(study.at("resolution_percent") == Approx(0.1));
  CHECK(study.at("dead_band_percent") == Approx(2.0));
  effects::StictionChoudhury sticky({0.3, 0.15});
  sticky.reset(5.0);
  const ValveFigures stuck = run(ValveTest::step_study, [&](double u) { return sticky.step(u); });
  CHECK(stuck.at("resolution_percent") == Approx(2.0));  // j is 1.5 %
  CHECK(stuck.at("dead_band_percent") == Approx(5.0));   // s is 3 %
  CHECK(std::isinf(run(ValveTest::step_study, [](double) { return 5.0; }).at("dead_band_percent")));

  CHECK(run(ValveTest::stepped_ramp, ideal).at("answered_percent") == Approx(100.0));
  // The first step after each of the two reversals is lost: 2 of 20.
  CHECK(run(ValveTest::stepped_ramp, backlash).at("answered_percent") == Approx(90.0));

  // A lag of 0.5 s: T63 is 0.5 s and T86 1 s, also with the sines.
  double x = 5.0;
  const auto lag = [&](double u) { return x += (u - x) * (1.0 - std::exp(-0.1 / 0.5)); };
  const ValveFigures step = run(ValveTest::step_change, lag);
  CHECK(step.at("up_t63_s") == Approx(0.5).margin(0.11));
  CHECK(step.at("down_t86_s") == Approx(1.0).margin(0.11));
  CHECK(step.at("up_travel") == Approx(3.0).epsilon(0.01));
  const ValveFigures sine = run(ValveTest::sine, lag);
  const double w = 2.0 * std::numbers::pi / 8.0;
  CHECK(sine.at("gain_at_8_s") == Approx(1.0 / std::hypot(1.0, 0.5 * w)).epsilon(0.02));
  CHECK(sine.at("phase_deg_at_64_s") ==
        Approx(-std::atan(0.5 * w / 8.0) * 180.0 / std::numbers::pi).margin(1.0));
}

TEST_CASE("the relay finds the limit of stability", "[analysis][relay]") {
  plant::LoopModel m;
  m.controller.pid.output_high = 10.0;
  m.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  m.transmitter.high = 20.0;
  plant::Plant p(m, 1);
  p.reset(4.0);
  RelayTest relay({.output = 4.0, .amplitude = 0.5, .target = 4.0 * 1.2264, .hysteresis = 0.01});
  for (int k = 0; k < 3000 && !relay.result(); ++k) {
    p.step(relay.step(p.time_s(), p.process_variable()));
  }
  REQUIRE(relay.result().has_value());
  // At the ultimate frequency atan(w T) + w L = pi: w = 0.859, Ku = sqrt(1 + (w T)^2)/K = 1.44.
  CHECK(relay.result()->ultimate_period_s == Approx(2.0 * std::numbers::pi / 0.859).epsilon(0.05));
  CHECK(relay.result()->ultimate_gain == Approx(1.44).epsilon(0.2));
  CHECK(relay.result()->tyreus_luyben().kp == Approx(relay.result()->ultimate_gain / 3.2));
}

TEST_CASE("condition indices are the worst of the known ones", "[analysis][condition]") {
  const ConditionIndices nothing = condition_indices({});
  CHECK(std::isnan(nothing.valve));
  CHECK(std::isnan(nothing.environment));
  const ConditionIndices some = condition_indices({.rms_error_percent = 1.0,
                                                   .stick_percent = 2.0,
                                                   .actuator_alarm = 1.0,
                                                   .stem_deviation_percent = 30.0,
                                                   .pv_bad_share = 0.0});
  CHECK(some.control_performance == Approx(80.0));
  CHECK(some.valve == Approx(80.0));
  CHECK(some.actuator == 0.0);
  CHECK(some.positioner == 0.0);
  CHECK(some.environment == 100.0);
}

}  // namespace valve_test_test
