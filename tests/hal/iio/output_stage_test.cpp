// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/output_stage.hpp"

#include <catch2/catch.hpp>
#include <limits>

namespace output_stage_test {

using namespace loopwarden::hal::iio;

namespace {

// 5 uA per step, CO 0 to 100 %.
AnalogOutputSettings percent() { return AnalogOutputSettings{}; }

}  // namespace

TEST_CASE("4 and 20 mA are the ends of the range") {
  const OutputStage stage(percent(), 0.005, 0.0);
  CHECK(stage.usable());
  CHECK(stage.raw_for(0.0) == 800);
  CHECK(stage.raw_for(100.0) == 4000);
  CHECK(stage.raw_for(50.0) == 2400);
  CHECK(stage.output_of(800) == Approx(0.0).margin(1e-9));
  CHECK(stage.output_of(4000) == Approx(100.0));
}

TEST_CASE("an output becomes the converter's nearest step") {
  const OutputStage stage(percent(), 0.005, 0.0);
  const double step = 100.0 / 3200.0;
  CHECK(stage.raw_for(0.49 * step) == 800);
  CHECK(stage.raw_for(0.51 * step) == 801);
  for (double output = 0.0; output <= 100.0; output += 0.377) {
    const double made = stage.output_of(stage.raw_for(output));
    REQUIRE(std::abs(made - output) <= 0.5 * step + 1e-9);
    // The result maps to the same raw value again.
    REQUIRE(stage.raw_for(made) == stage.raw_for(output));
  }
}

TEST_CASE("the limits of current act on every command, and round inwards") {
  AnalogOutputSettings settings = percent();
  settings.highest_ma = 20.4;
  const OutputStage stage(settings, 0.007, 0.0);
  CHECK(stage.raw_for(-1e6) == 543);  // 3.801 mA
  CHECK(stage.raw_for(1e6) == 2914);  // 20.398 mA
  CHECK(stage.raw_for(std::numeric_limits<double>::infinity()) == 2914);
}

TEST_CASE("the converter's own range acts as well") {
  AnalogOutputSettings settings = percent();
  settings.lowest_raw = 900;
  settings.highest_raw = 3000;
  const OutputStage stage(settings, 0.005, 0.0);
  CHECK(stage.raw_for(0.0) == 900);
  CHECK(stage.raw_for(100.0) == 3000);
}

TEST_CASE("scale and offset are those of IIO: physical = (raw + offset) * scale") {
  AnalogOutputSettings settings = percent();
  settings.channel.units_per_ma = 250.0;  // ohm: a voltage channel in mV
  settings.lowest_raw = -32768;
  settings.highest_raw = 32767;
  const OutputStage stage(settings, 0.5, 1000.0);
  // 12 mA through 250 ohm are 3000 mV, (raw + 1000) * 0.5.
  CHECK(stage.raw_for(50.0) == 5000);
  CHECK(stage.output_of(5000) == Approx(50.0));
}

TEST_CASE("a reversed range and a falling converter work") {
  AnalogOutputSettings settings = percent();
  settings.low = 100.0;
  settings.high = 0.0;
  const OutputStage reversed(settings, 0.005, 0.0);
  CHECK(reversed.raw_for(100.0) == 800);
  CHECK(reversed.raw_for(0.0) == 4000);
  CHECK(reversed.raw_for(200.0) == 760);

  settings = percent();
  const OutputStage falling(settings, -0.005, -4095.0);
  CHECK(falling.usable());
  CHECK(falling.raw_for(0.0) == 3295);
  CHECK(falling.raw_for(100.0) == 95);
  CHECK(falling.output_of(95) == Approx(100.0));
}

TEST_CASE("the safe current is limited by the converter only") {
  const OutputStage stage(percent(), 0.005, 0.0);
  CHECK(stage.raw_for_ma(3.5) == 700);
  CHECK(stage.raw_for_ma(0.0) == 0);
  CHECK(stage.raw_for_ma(30.0) == 4095);
}

TEST_CASE("a converter that reaches no permitted current is not usable") {
  CHECK_FALSE(OutputStage(percent(), 1e-6, 0.0).usable());
  CHECK_FALSE(OutputStage(percent(), 1e300, 0.0).usable());
  CHECK_FALSE(OutputStage(percent(), 0.005, 1e12).usable());
}

}  // namespace output_stage_test
