// SPDX-License-Identifier: Apache-2.0
#include "config/analog_reader.hpp"

#include "tests/config/config_support.hpp"

namespace analog_reader_test {

using namespace loopwarden;
using namespace loopwarden::config;
using test::kAnalogLoop;
using test::said_of_loop;
using test::with;

namespace {

hal::iio::AnalogSettings read(const std::string& text) {
  const auto loop = read_loop_text("loop.yaml", text, {});
  INFO(to_text(loop.diagnostics));
  REQUIRE(loop);
  return std::get<hal::iio::AnalogSettings>(loop->io);
}

std::string with_lines(const std::string& lines) { return kAnalogLoop + lines; }

}  // namespace

TEST_CASE("An analog loop knows its channels and lines", "[config][analog]") {
  const hal::iio::AnalogSettings io =
      read(with_lines("  read_back: {device: adc, channel: voltage1, range: [0, 12]}\n"
                      "  enable: {line: ENABLE, active_low: true, debounce: 0.1}\n"
                      "  alarm_relay: {chip: gpiochip1, line: '4'}\n"
                      "  alive: {line: ALIVE, half_period: 0.25}\n"
                      "  poll_period: 0.05\n"));
  CHECK(io.process_variable.channel.device == "adc");
  CHECK(io.process_variable.channel.channel == "voltage0");
  CHECK(io.process_variable.channel.units_per_ma == 250.0);
  CHECK(io.process_variable.low == 0.0);  // PV's range
  CHECK(io.process_variable.high == 10.0);
  CHECK(io.process_variable.ne43 == hal::iio::Ne43Settings{});
  REQUIRE(io.read_back);
  CHECK(io.read_back->high == 12.0);
  CHECK(io.output.channel.channel == "current1");
  CHECK(io.output.high == 10.0);
  CHECK_FALSE(io.output.safe_ma);
  REQUIRE(io.enable);
  CHECK(io.enable->line.chip.empty());
  CHECK(io.enable->line.line == "ENABLE");
  CHECK(io.enable->line.active_low);
  CHECK(io.enable->debounce_s == 0.1);
  REQUIRE(io.alarm_relay);
  CHECK(io.alarm_relay->chip == "gpiochip1");
  CHECK(io.alarm_relay->line == "4");
  REQUIRE(io.alive);
  CHECK(io.alive->half_period_s == 0.25);
  CHECK(io.poll_period_ns == 50'000'000);
}

TEST_CASE("raw states a converter's numbers at 4 and at 20 mA", "[config][analog]") {
  const hal::iio::AnalogSettings io =
      read(with(with(kAnalogLoop, "units_per_ma: 250", "raw: [5530, 27648]"), "channel: current1",
                "channel: current1\n    highest_raw: 32767\n    raw: [0, 27648]"));
  const auto ma = [](const hal::iio::ChannelSettings& channel, double raw) {
    return (raw + *channel.offset) * *channel.scale / channel.units_per_ma;
  };
  CHECK(ma(io.process_variable.channel, 5530.0) == Approx(4.0));
  CHECK(ma(io.process_variable.channel, 27648.0) == Approx(20.0));
  CHECK(ma(io.output.channel, 0.0) == Approx(4.0));
  CHECK(ma(io.output.channel, 27648.0) == Approx(20.0));

  CHECK(
      said_of_loop(with(kAnalogLoop, "units_per_ma: 250", "units_per_ma: 250, raw: [0, 27648]")) ==
      "loop.yaml:18:57: error: io.input.units_per_ma: conflicts with raw (at 18:67); give only "
      "raw, or units_per_ma, scale and offset\n");
  CHECK(
      said_of_loop(with(kAnalogLoop, "units_per_ma: 250", "raw: [27648, 5530]")) ==
      "loop.yaml:18:48: error: io.input.raw: must be [low, high] with low below high (got [27648, "
      "5530])\n");
  CHECK(said_of_loop(
            with(kAnalogLoop, "channel: current1", "channel: current1\n    raw: [0, 27648]")) ==
        "loop.yaml:22:10: error: io.output.raw: must lie within lowest_raw = 0 and highest_raw = "
        "4095, the range that the converter accepts (got [0, 27648])\n");
}

TEST_CASE("The limits of NE 43 rise", "[config][analog]") {
  const hal::iio::AnalogSettings io =
      read(with(kAnalogLoop, "units_per_ma: 250}",
                "ne43: {failure_low: 3.5, entry_samples: 5, recovery: 1}}"));
  CHECK(io.process_variable.ne43.limits.failure_low == 3.5);
  CHECK(io.process_variable.ne43.limits.measure_low == 3.8);
  CHECK(io.process_variable.ne43.entry_samples == 5);
  CHECK(io.process_variable.ne43.recovery_s == 1.0);
  CHECK(said_of_loop(with(kAnalogLoop, "units_per_ma: 250}", "ne43: {failure_high: 20}}")) ==
        "loop.yaml:18:64: error: io.input.ne43.failure_high: must be above "
        "io.input.ne43.measure_high "
        "= 20.5 mA (got 20)\n");
}

TEST_CASE("Errors of an analog output", "[config][analog]") {
  CHECK(said_of_loop(with(kAnalogLoop, "    comm_loss: none_accepted\n", ""))
            .starts_with(
                "loop.yaml:20:5: error: io.output: missing key 'comm_loss' ({timeout, set_by: "
                "device} or none_accepted). When the link is down"));
  CHECK(said_of_loop(with(kAnalogLoop, "none_accepted", "{timeout: 2, set_by: device}")).empty());
  CHECK(said_of_loop(with(kAnalogLoop, "none_accepted", "{timeout: 2}")) ==
        "loop.yaml:22:16: error: io.output.comm_loss: must be {timeout, set_by: device} or "
        "none_accepted\n");
  CHECK(said_of_loop(with(kAnalogLoop, "channel: current1\n",
                          "channel: current1\n    safe_current: 23\n    highest_raw: 0\n")) ==
        "loop.yaml:22:19: error: io.output.safe_current: must be >= 0 and <= 22 mA (got 23)\n"
        "loop.yaml:23:18: error: io.output.highest_raw: must be above lowest_raw = 0 (got 0)\n");
  CHECK(said_of_loop(with(kAnalogLoop, "device: adc, ", "")) ==
        "loop.yaml:18:10: error: missing key 'device' in 'io.input' (text)\n");
}

TEST_CASE("The converter's step is no windup", "[config][analog]") {
  const auto loop = read_loop_text(
      "loop.yaml",
      with(kAnalogLoop, "channel: current1\n", "channel: current1\n    highest_raw: 1000\n"), {});
  REQUIRE(loop);
  CHECK(loop->controller.pid.tolerance == Approx(0.01));
}

}  // namespace analog_reader_test
