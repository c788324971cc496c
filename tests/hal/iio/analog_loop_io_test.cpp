// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/analog_loop_io.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <limits>
#include <stdexcept>
#include <thread>

#include "tests/hal/iio/fake_gpio.hpp"
#include "tests/hal/iio/fake_iio.hpp"

namespace analog_loop_io_test {

using namespace loopwarden::hal;
using namespace loopwarden::hal::iio;
using loopwarden::tests::FakeGpio;
using loopwarden::tests::FakeIio;
using std::chrono::milliseconds;

namespace {

struct Bench {
  FakeIio iio;
  std::shared_ptr<FakeGpio::Lines> lines = std::make_shared<FakeGpio::Lines>();
  AnalogSettings settings;
  loopwarden::base::MonotonicClock clock;

  Bench() {
    settings.iio_root = iio.root();
    settings.process_variable.channel.device = "board";
    settings.process_variable.channel.channel = "current0";
    settings.output.channel = settings.process_variable.channel;
    settings.output.safe_ma = 3.5;
    settings.enable = EnableSettings{.line = {.chip = "", .line = "enable"}, .debounce_s = 0.0};
    settings.alarm_relay = LineSettings{.chip = "", .line = "relay"};
    settings.poll_period_ns = 5'000'000;
    settings.max_command_age_ns = 300'000'000;
    (*lines)["enable"].active = true;
    (*lines)["relay"];
  }
  std::unique_ptr<AnalogLoopIo> io() {
    return std::make_unique<AnalogLoopIo>(settings, "FIC-101", EventSink{},
                                          std::make_unique<FakeGpio>(lines));
  }
  double write(LoopIo& io, double output) {
    const std::int64_t now = clock.now_ns();
    return io.write({.now_ns = now, .period_index = 0},
                    {.output = output, .time_ns = now, .write = true, .alarm = false});
  }
  Inputs read(LoopIo& io) {
    Inputs inputs;
    io.read({.now_ns = clock.now_ns(), .period_index = 0}, inputs);
    return inputs;
  }
};

// A generous limit, because test hosts are loaded.
template <class Condition>
bool eventually(Condition condition) {
  for (int i = 0; i < 12'000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(milliseconds(5));
  }
  return false;
}

}  // namespace

TEST_CASE("a loop on converters: values in, commands out, alive and silent") {
  Bench bench;
  bench.iio.add_board(2, "board");
  const auto io = bench.io();
  CHECK(bench.read(*io).process_variable.quality == Quality::bad);
  io->open();
  CHECK(bench.read(*io).process_variable.value == Approx(50.0));
  CHECK(bench.read(*io).enable == Enable::closed);

  // The loop renews its command, and receives the value that the converter makes of it.
  const double step = 100.0 / 3200.0;
  CHECK(eventually([&] {
    CHECK(bench.write(*io, 25.0 + 0.3 * step) == Approx(25.0));
    return bench.iio.get(2, "out_current0_raw") == "1600";
  }));
  CHECK(eventually([&] {
    bench.write(*io, 25.0);
    return (*bench.lines)["relay"].active.load();
  }));
  bench.iio.change(2, "in_current0_raw", "1600");
  CHECK(eventually([&] { return bench.read(*io).process_variable.value == Approx(25.0); }));
  (*bench.lines)["enable"].active = false;
  CHECK(eventually([&] { return bench.read(*io).enable == Enable::open; }));

  // The loop falls silent.
  CHECK(eventually([&] { return bench.iio.get(2, "out_current0_raw") == "700"; }));
  CHECK(eventually([&] { return !(*bench.lines)["relay"].active; }));
  CHECK(eventually([&] { return !bench.read(*io).output_ok; }));
  CHECK(io->counters().old_commands_withheld >= 1);
  const std::uint64_t ticks = io->ticks();
  CHECK(eventually([&] { return io->ticks() > ticks; }));
}

TEST_CASE("while its I/O thread hangs the output counts as lost") {
  Bench bench;
  bench.iio.add_board(0, "board");
  const auto io = bench.io();
  io->open();
  CHECK(eventually([&] {
    bench.write(*io, 50.0);
    return bench.read(*io).output_ok;
  }));
  (*bench.lines)["enable"].hangs = true;
  CHECK(eventually([&] {
    bench.write(*io, 60.0);
    return bench.read(*io).output_reason == Reason::link_lost;
  }));
  CHECK_FALSE(bench.read(*io).output_ok);
  (*bench.lines)["enable"].hangs = false;
  CHECK(eventually([&] {
    bench.write(*io, 60.0);
    return bench.read(*io).output_ok && bench.iio.get(0, "out_current0_raw") == "2720";
  }));
}

TEST_CASE("the output's limits are known before the converter is found") {
  Bench bench;
  const auto io = bench.io();
  io->open();
  // Before the first command: after it the I/O thread may have failed at any time.
  CHECK(bench.read(*io).output_reason == Reason::never_received);
  CHECK(bench.write(*io, 1000.0) == Approx(103.125));
  CHECK(bench.write(*io, -1000.0) == Approx(-1.25));
  CHECK(bench.write(*io, 33.3) == Approx(33.3));
  // After a failed command it is lost.
  CHECK(eventually([&] { return bench.read(*io).output_reason == Reason::link_lost; }));
  CHECK_FALSE(bench.read(*io).output_ok);
}

TEST_CASE("a value that is no number is never put out") {
  Bench bench;
  bench.iio.add_board(0, "board");
  const auto io = bench.io();
  io->open();
  const double before = bench.write(*io, 25.0);
  CHECK(bench.write(*io, std::numeric_limits<double>::quiet_NaN()) == before);
  CHECK(bench.write(*io, std::numeric_limits<double>::infinity()) == before);
}

TEST_CASE("drive puts an output out and keeps it") {
  Bench bench;
  bench.iio.add_board(0, "board");
  bench.settings.max_command_age_ns = 20'000'000;
  const auto io = bench.io();
  std::string why;
  CHECK_FALSE(io->drive(0.0, milliseconds(10), why));
  CHECK(why == "the backend is not open");
  io->open();
  CHECK_FALSE(io->drive(std::nan(""), milliseconds(10), why));
  REQUIRE(io->drive(10.0, milliseconds(60'000), why));
  CHECK(bench.iio.get(0, "out_current0_raw") == "1120");
  std::this_thread::sleep_for(milliseconds(100));  // far longer than the age limit of commands
  io->close();
  CHECK(bench.iio.get(0, "out_current0_raw") == "1120");
}

TEST_CASE("drive on an absent converter reports the reason") {
  Bench bench;
  const auto io = bench.io();
  io->open();
  std::string why;
  CHECK_FALSE(io->drive(10.0, milliseconds(1000), why));
  CHECK(why == "FIC-101 output has not taken the command: link lost");
}

TEST_CASE("it can be closed and opened again") {
  Bench bench;
  bench.iio.add_board(0, "board");
  const auto io = bench.io();
  io->close();
  for (int i = 0; i < 3; ++i) {
    io->open();
    io->open();
    CHECK((*bench.lines)["enable"].requested);
    io->close();
    CHECK_FALSE((*bench.lines)["enable"].requested);
  }
}

TEST_CASE("settings that can't work are refused at once") {
  const auto opening = [](auto change) {
    Bench bench;
    change(bench.settings);
    const auto io = bench.io();
    io->open();
  };
  CHECK_THROWS_AS(opening([](AnalogSettings& s) { s.output.high = s.output.low; }),
                  std::runtime_error);
  CHECK_THROWS_AS(opening([](AnalogSettings& s) { s.output.highest_raw = 0; }), std::runtime_error);
  CHECK_THROWS_AS(
      opening([](AnalogSettings& s) { s.process_variable.high = s.process_variable.low; }),
      std::runtime_error);
  CHECK_THROWS_AS(opening([](AnalogSettings& s) { s.poll_period_ns = 0; }), std::runtime_error);
}

}  // namespace analog_loop_io_test
