// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/analog_input.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "tests/hal/iio/fake_iio.hpp"

namespace analog_input_test {

using namespace loopwarden::hal;
using namespace loopwarden::hal::iio;
using loopwarden::tests::FakeIio;
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

struct Bench {
  FakeIio iio;
  std::vector<AnalogEvent> events;
  AnalogInputSettings settings;
  Bench() {
    settings.channel.device = "board";
    settings.channel.channel = "current0";
    settings.low = 0.0;
    settings.high = 10.0;
  }
  AnalogInput input() {
    return AnalogInput(iio.root(), settings, "FIC-101 input",
                       [this](const AnalogEvent& event) { events.push_back(event); });
  }
};

}  // namespace

TEST_CASE("a current becomes a value in engineering units, with time and sequence") {
  Bench bench;
  bench.iio.add_board(0, "board");
  AnalogInput input = bench.input();
  CHECK(input.sample().quality == Quality::bad);
  CHECK(input.sample().reason == Reason::never_received);
  input.poll(5 * kSecond);
  CHECK(input.sample().value == Approx(5.0));  // 2400 * 5 uA = 12 mA
  CHECK(input.sample().quality == Quality::good);
  CHECK(input.sample().time_ns == 5 * kSecond);
  CHECK(input.sample().sequence == 1);
  input.poll(6 * kSecond);
  CHECK(input.sample().time_ns == 6 * kSecond);
  CHECK(input.sample().sequence == 2);
  CHECK(input.connected());
}

TEST_CASE("a voltage channel is read across its shunt") {
  Bench bench;
  bench.iio.set(0, "name", "board\n");
  bench.iio.set(0, "in_voltage2_raw", "8000\n");
  bench.iio.set(0, "in_voltage_scale", "0.125\n");  // 1000 mV
  bench.settings.channel.channel = "voltage2";
  bench.settings.channel.units_per_ma = 50.0;  // ohm: 20 mA
  AnalogInput input = bench.input();
  input.poll(0);
  CHECK(input.sample().value == Approx(10.0));
}

TEST_CASE("while no measurement arrives the sample keeps its value, time and sequence") {
  Bench bench;
  bench.iio.add_board(0, "board");
  AnalogInput input = bench.input();
  input.poll(1 * kSecond);
  bench.iio.change(0, "in_current0_raw", "0740");  // 3.7 mA
  input.poll(2 * kSecond);
  CHECK(input.sample().quality == Quality::uncertain);
  CHECK(input.sample().value == Approx(5.0));
  CHECK(input.sample().time_ns == 1 * kSecond);
  CHECK(input.sample().sequence == 1);
  bench.iio.change(0, "in_current0_raw", "0000");
  for (int i = 0; i < 3; ++i) input.poll(3 * kSecond + i);
  CHECK(input.sample().quality == Quality::bad);
  CHECK(input.sample().reason == Reason::sensor_failure);
  CHECK(input.sample().time_ns == 1 * kSecond);
  CHECK(input.sample().sequence == 1);
}

TEST_CASE("a reversed range reverses the limit") {
  Bench bench;
  bench.iio.add_board(0, "board");
  bench.settings.low = 10.0;
  bench.settings.high = 0.0;
  AnalogInput input = bench.input();
  bench.iio.change(0, "in_current0_raw", "0780");  // 3.9 mA
  input.poll(0);
  CHECK(input.sample().value > 10.0);
  CHECK(input.sample().limit == Limit::high);
}

TEST_CASE("an input whose device is absent at start is good when it appears") {
  Bench bench;
  AnalogInput input = bench.input();
  for (int i = 0; i < 10; ++i) input.poll(i * kSecond / 10);
  CHECK(input.sample().quality == Quality::bad);
  CHECK(input.sample().reason == Reason::never_received);
  CHECK_FALSE(input.connected());
  REQUIRE(bench.events.size() == 1);
  CHECK_FALSE(bench.events[0].good);
  CHECK_THAT(bench.events[0].text, Catch::StartsWith("FIC-101 input: no IIO device"));

  bench.iio.add_board(4, "board");
  input.poll(9 * kSecond / 10);
  CHECK(input.sample().quality == Quality::bad);  // it is probed once a second
  input.poll(kSecond);
  CHECK(input.sample().quality == Quality::good);
  for (int i = 0; i < 20; ++i) input.poll(kSecond + i * kSecond / 10);
  REQUIRE(bench.events.size() == 2);
  CHECK(bench.events[1].good);
  CHECK(input.connected());
}

TEST_CASE("a text from the driver that is no number is an error of the device") {
  Bench bench;
  bench.iio.add_board(0, "board");
  AnalogInput input = bench.input();
  input.poll(0);
  bench.iio.change(0, "in_current0_raw", "oops");
  input.poll(1);
  CHECK(input.sample().quality == Quality::bad);
  CHECK(input.sample().reason == Reason::device_error);
  CHECK(input.counters().garbage == 1);
  CHECK_FALSE(input.connected());
  bench.iio.change(0, "in_current0_raw", "2400");
  input.poll(2);
  CHECK(input.sample().quality == Quality::good);
  CHECK(input.counters().transactions == 3);
}

TEST_CASE("a device that fails now and then is one line in the log") {
  Bench bench;
  bench.iio.add_board(0, "board");
  AnalogInput input = bench.input();
  for (int i = 0; i < 100; ++i) {
    bench.iio.change(0, "in_current0_raw", i % 2 == 0 ? "oops" : "2400");
    input.poll(i * kSecond / 10);
  }
  CHECK(bench.events.size() == 1);
  CHECK(input.counters().garbage == 50);
}

TEST_CASE("a reading that fails interrupts the way out of a sensor failure") {
  Bench bench;
  bench.iio.add_board(0, "board");
  bench.iio.change(0, "in_current0_raw", "0000");
  AnalogInput input = bench.input();
  input.poll(0);
  bench.iio.change(0, "in_current0_raw", "2400");
  input.poll(1 * kSecond);
  bench.iio.change(0, "in_current0_raw", "oops");
  input.poll(2 * kSecond);
  bench.iio.change(0, "in_current0_raw", "2400");
  input.poll(3 * kSecond + kSecond / 2);
  CHECK(input.sample().quality == Quality::bad);
  input.poll(6 * kSecond);
  CHECK(input.sample().quality == Quality::good);
}

}  // namespace analog_input_test
