// SPDX-License-Identifier: Apache-2.0
#include "model/effects/effect.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "model/effects/backlash/backlash.hpp"
#include "model/effects/drift/drift.hpp"
#include "model/effects/extra_dead_time/extra_dead_time.hpp"
#include "model/effects/gain_change/gain_change.hpp"
#include "model/effects/output_bias/output_bias.hpp"
#include "model/effects/positioner_overshoot/positioner_overshoot.hpp"
#include "model/effects/random_load/random_load.hpp"
#include "model/effects/stiction/stiction_inertial.hpp"
#include "model/effects/valve_characteristic/valve_characteristic.hpp"
#include "model/effects/low_air_supply/low_air_supply.hpp"
#include "model/effects/step_disturbance/step_disturbance.hpp"

namespace effect_test {

using namespace loopwarden;
using namespace loopwarden::effects;

TEST_CASE("a schedule defines the time and the severity", "[plant][effect]") {
  CHECK(Schedule{}.always());
  CHECK(Schedule{}.severity(-1e9) == 1.0);
  const Schedule schedule{.from_s = 100.0, .to_s = 300.0, .ramp_s = 50.0};
  CHECK_FALSE(schedule.always());
  CHECK(schedule.severity(99.9) == 0.0);
  CHECK(schedule.severity(100.0) == 0.0);
  CHECK(schedule.severity(125.0) == Approx(0.5));
  CHECK(schedule.severity(150.0) == 1.0);
  CHECK(schedule.severity(299.9) == 1.0);
  CHECK(schedule.severity(300.0) == 0.0);
  CHECK(Schedule{.from_s = 100.0}.severity(100.0) == 1.0);
}

TEST_CASE("an empty chain is a wire", "[plant][effect]") {
  EffectChain chain;
  CHECK(chain.empty());
  CHECK(chain.reset(3.0, 0.0) == 3.0);
  double stem = 0.0;
  CHECK(chain.step(4.0, 0.1, stem) == 4.0);
  CHECK(stem == 4.0);
  CHECK(chain.scheduled_severity(0.0) == 0.0);
}

TEST_CASE("effects act in the order in which they were added", "[plant][effect]") {
  EffectChain bias_first;
  bias_first.add(OutputBias(1.0));
  bias_first.add(GainChange(2.0));
  CHECK(bias_first.step(3.0, 0.0) == 8.0);
  EffectChain gain_first;
  gain_first.add(GainChange(2.0));
  gain_first.add(OutputBias(1.0));
  CHECK(gain_first.step(3.0, 0.0) == 7.0);
}

TEST_CASE("a whole signal at once gives the same bits as sample by sample", "[plant][effect]") {
  EffectChain chain;
  chain.add(PositionerOvershoot(0.3, 4.0, 0.1));
  chain.add(StictionInertial({.s = 6.0, .j = 2.0}, {}, 0.1), {.from_s = 3.0, .ramp_s = 20.0});
  chain.add(Backlash(1.0));
  chain.add(Drift(0.01));
  chain.add(ExtraDeadTime(0.25, 0.1));
  EffectChain stepped = chain;
  std::vector<double> signal;
  for (int k = 0; k < 600; ++k) signal.push_back(50.0 + 20.0 * std::sin(0.03 * k));
  std::vector<double> expected;
  chain.reset(signal[0], 0.5);
  stepped.reset(signal[0], 0.5);
  for (std::size_t k = 0; k < signal.size(); ++k) {
    expected.push_back(stepped.step(signal[k], 0.5 + static_cast<double>(k) * 0.1));
  }
  chain.run(signal, 0.5, 0.1);
  CHECK(signal == expected);
}

TEST_CASE("the stem is the input of the first characteristic", "[plant][effect]") {
  EffectChain chain;
  chain.add(LowAirSupply({.rate = 1e9, .travel_limit = 60.0}, 0.1));
  chain.add(ValveCharacteristic({.curve = ValveCharacteristic::Curve::quick_opening}, 0.0, 100.0));
  double stem = 0.0;
  CHECK(chain.reset(36.0, 0.0, stem) == Approx(60.0));
  CHECK(stem == 36.0);
  CHECK(chain.reset(80.0, 0.0, stem) == Approx(77.459667));
  CHECK(stem == 60.0);
  CHECK(chain.step(49.0, 0.1, stem) == Approx(70.0));
  CHECK(stem == Approx(49.0));
}

TEST_CASE("of two characteristics the first has the stem before it", "[plant][effect]") {
  const ValveCharacteristic root({.curve = ValveCharacteristic::Curve::quick_opening}, 0.0, 100.0);
  EffectChain chain;
  chain.add(root);
  chain.add(root);
  double stem = 0.0;
  CHECK(chain.step(1.0, 0.0, stem) == Approx(std::sqrt(1000.0)));
  CHECK(stem == 1.0);
}

TEST_CASE("effects on a schedule begin, ramp and end; others are always active",
          "[plant][effect]") {
  EffectChain chain;
  chain.add(OutputBias(10.0), {.from_s = 1.0, .to_s = 5.0, .ramp_s = 2.0});
  chain.add(GainChange(2.0));
  CHECK(chain.step(1.0, 0.5) == 2.0);
  CHECK(chain.step(1.0, 2.0) == Approx(12.0));
  CHECK(chain.step(1.0, 4.0) == Approx(22.0));
  CHECK(chain.step(1.0, 5.0) == 2.0);
  CHECK(chain.scheduled_severity(2.0) == Approx(0.5));
  CHECK(chain.scheduled_severity(0.0) == 0.0);
  CHECK(chain.reset(1.0, 4.0) == Approx(22.0));
  CHECK(chain.reset(1.0, 0.0) == 2.0);
}

TEST_CASE("the largest of the scheduled severities is reported", "[plant][effect]") {
  EffectChain chain;
  chain.add(OutputBias(1.0), {.from_s = 0.0, .ramp_s = 10.0});
  chain.add(GainChange(2.0), {.from_s = 5.0, .ramp_s = 1.0});
  CHECK(chain.scheduled_severity(3.0) == Approx(0.3));
  CHECK(chain.scheduled_severity(6.0) == Approx(1.0));
}

TEST_CASE("time reaches the effects that depend on it", "[plant][effect]") {
  EffectChain chain;
  chain.add(Drift(0.5));
  chain.add(StepDisturbance(3.0, 8.0));
  CHECK(chain.step(1.0, 4.0) == Approx(3.0));
  CHECK(chain.step(1.0, 8.0) == Approx(8.0));
}

TEST_CASE("a copy continues like the original and does not disturb it", "[plant][effect]") {
  EffectChain chain;
  chain.add(Backlash(2.0));
  chain.add(RandomLoad(0.3, 5.0, 0.1, 9));
  chain.reset(5.0, 0.0);
  chain.step(7.0, 0.0);
  EffectChain copy = chain;
  for (int k = 1; k < 50; ++k) {
    const double expected = chain.step(7.0 - 0.1 * k, 0.1 * k);
    REQUIRE(copy.step(7.0 - 0.1 * k, 0.1 * k) == expected);
  }
}

}  // namespace effect_test
