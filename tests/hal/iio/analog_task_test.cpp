// SPDX-License-Identifier: Apache-2.0
#include "hal/iio/analog_task.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "tests/hal/iio/fake_gpio.hpp"
#include "tests/hal/iio/fake_iio.hpp"

namespace analog_task_test {

using namespace loopwarden::hal;
using namespace loopwarden::hal::iio;
using loopwarden::tests::FakeGpio;
using loopwarden::tests::FakeIio;
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t kMs = 1'000'000;

// A loop at 100 ms whose commands grow too old after 400 ms.
struct Bench {
  FakeIio iio;
  std::shared_ptr<FakeGpio::Lines> lines = std::make_shared<FakeGpio::Lines>();
  FakeGpio gpio{lines};
  AnalogSettings settings;
  AnalogCommand command;
  std::vector<AnalogEvent> events;

  Bench() {
    iio.add_board(0, "board");
    settings.iio_root = iio.root();
    settings.process_variable.channel.device = "board";
    settings.process_variable.channel.channel = "current0";
    settings.output.channel = settings.process_variable.channel;
    settings.output.safe_ma = 3.5;
    settings.alarm_relay = LineSettings{.chip = "", .line = "relay"};
    settings.alive = AliveSettings{.line = {.chip = "", .line = "alive"}, .half_period_s = 0.1};
    (*lines)["relay"];
    (*lines)["alive"];
  }
  AnalogTask task() {
    return AnalogTask(settings, "FIC-101", gpio,
                      [this](const AnalogEvent& event) { events.push_back(event); });
  }
  void give(AnalogTask& task, double output, std::int64_t now_ns, bool write = true) {
    command = {.output = output,
               .time_ns = now_ns,
               .id = command.id + 1,
               .write = write,
               .alarm = false,
               .parked = false};
    task.commands.publish(command);
  }
  std::string raw() const { return iio.get(0, "out_current0_raw"); }
};

}  // namespace

TEST_CASE("inputs are polled at their period and published with the known output") {
  Bench bench;
  AnalogTask task = bench.task();
  task.open(0);
  AnalogState state = task.state.newest();
  CHECK(state.inputs.process_variable.value == Approx(50.0));
  CHECK(state.inputs.process_variable.sequence == 1);
  CHECK_FALSE(state.inputs.valve_position_fitted);
  CHECK_FALSE(state.inputs.output_ok);
  CHECK(state.inputs.output_reason == Reason::never_received);
  CHECK(state.stage_known);
  task.step(50 * kMs);
  CHECK(task.state.newest().inputs.process_variable.sequence == 1);
  task.step(100 * kMs);
  CHECK(task.state.newest().inputs.process_variable.sequence == 2);
  // A late turn keeps the phase.
  task.step(350 * kMs);
  task.step(399 * kMs);
  CHECK(task.state.newest().inputs.process_variable.sequence == 3);
  CHECK(task.due_ns(399 * kMs) == 400 * kMs);
  task.step(400 * kMs);
  CHECK(task.state.newest().inputs.process_variable.sequence == 4);
}

TEST_CASE("the valve's read-back is delivered if it is fitted") {
  Bench bench;
  bench.iio.set(0, "in_current1_raw", "1600\n");  // 8 mA
  bench.settings.read_back = bench.settings.process_variable;
  bench.settings.read_back->channel.channel = "current1";
  AnalogTask task = bench.task();
  task.open(0);
  CHECK(task.state.newest().inputs.valve_position_fitted);
  CHECK(task.state.newest().inputs.valve_position.value == Approx(25.0));
}

TEST_CASE("a command is put out on the next turn, not only on the next poll") {
  Bench bench;
  AnalogTask task = bench.task();
  task.open(0);
  CHECK(bench.raw() == "0");  // no write before the first command
  bench.give(task, 50.0, 30 * kMs);
  task.step(40 * kMs);
  CHECK(bench.raw() == "2400");
  CHECK(task.state.newest().written_id == 1);
  CHECK(task.state.newest().inputs.output_ok);
  bench.give(task, 75.0, 50 * kMs, false);
  task.step(50 * kMs);
  CHECK(bench.raw() == "2400");
}

TEST_CASE("before the first command converter, relay and alive line are not driven") {
  Bench bench;
  AnalogTask task = bench.task();
  task.open(0);
  // Like a loop whose output position is unknown.
  for (int i = 0; i < 20; ++i) {
    bench.give(task, 50.0, i * 100 * kMs, false);
    task.step(i * 100 * kMs);
  }
  CHECK(bench.raw() == "0");
  CHECK_FALSE((*bench.lines)["alive"].requested);
  CHECK_FALSE((*bench.lines)["relay"].active);
  CHECK(task.counters().writes == 0);
  CHECK(task.state.newest().inputs.output_reason == Reason::never_received);

  SECTION("not when the loop hangs either") {
    for (int i = 20; i < 60; ++i) task.step(i * 100 * kMs);
    CHECK(bench.raw() == "0");
    CHECK(task.counters().old_commands_withheld == 0);
    CHECK(task.state.newest().inputs.output_reason == Reason::never_received);
  }
  SECTION("nor when the converter has hung: no command was lost by it") {
    bench.give(task, 50.0, 5900 * kMs, false);
    task.step(6000 * kMs);
    CHECK(task.state.newest().inputs.output_reason == Reason::never_received);
  }
  bench.give(task, 50.0, 7000 * kMs);
  task.step(7000 * kMs);
  bench.give(task, 50.0, 7100 * kMs);
  task.step(7100 * kMs);
  CHECK(bench.raw() == "2400");
  CHECK((*bench.lines)["alive"].edges > 0);
  CHECK((*bench.lines)["relay"].active);
}

TEST_CASE("the alive line of a loop with a read-back lives from the first cycle") {
  Bench bench;
  bench.iio.set(0, "in_current1_raw", "1600\n");
  bench.settings.read_back = bench.settings.process_variable;
  bench.settings.read_back->channel.channel = "current1";
  AnalogTask task = bench.task();
  task.open(0);
  bench.give(task, 50.0, 0, false);
  task.step(0);
  CHECK((*bench.lines)["alive"].edges == 0);
  bench.give(task, 50.0, 100 * kMs, false);
  task.step(100 * kMs);
  CHECK((*bench.lines)["alive"].edges == 1);
  CHECK(bench.raw() == "0");
}

TEST_CASE("the lines are served before the inputs, which may take their time") {
  Bench bench;
  int edges_when_read = -1;
  AnalogTask task(bench.settings, "FIC-101", bench.gpio,
                  [&](const AnalogEvent&) { edges_when_read = (*bench.lines)["alive"].edges; });
  task.open(0);
  bench.give(task, 50.0, 0);
  task.step(0);
  REQUIRE((*bench.lines)["alive"].requested);
  bench.iio.change(0, "in_current0_raw", "x");
  task.step(100 * kMs);
  CHECK(edges_when_read == 1);
}

TEST_CASE("after its thread has hung, only commands that the loop gave knowing this are put out") {
  Bench bench;
  AnalogTask task = bench.task();
  task.open(0);
  bench.give(task, 50.0, 0);
  task.step(0);
  CHECK(bench.raw() == "2400");
  // The converter answers after 900 ms. The loop has continued meanwhile.
  bench.give(task, 75.0, 890 * kMs);
  task.step(900 * kMs);
  CHECK(bench.raw() == "2400");
  CHECK_FALSE(task.state.newest().inputs.output_ok);
  CHECK(task.state.newest().inputs.output_reason == Reason::stale);
  CHECK(task.state.newest().time_ns == 900 * kMs);
  bench.give(task, 60.0, 910 * kMs);
  task.step(910 * kMs);
  CHECK(bench.raw() == "2720");
  CHECK(task.state.newest().inputs.output_ok);
  // A shorter delay of a turn is no such case.
  bench.give(task, 75.0, 920 * kMs);
  task.step(1310 * kMs);
  CHECK(bench.raw() == "3200");
}

TEST_CASE("when commands end the safe current is put out, once, and reported") {
  Bench bench;
  AnalogTask task = bench.task();
  task.open(0);
  bench.give(task, 50.0, 0);
  task.step(0);
  CHECK((*bench.lines)["relay"].active);
  task.step(400 * kMs);
  CHECK(bench.raw() == "2400");
  task.step(401 * kMs);
  CHECK(bench.raw() == "700");
  CHECK_FALSE((*bench.lines)["relay"].active);
  CHECK_FALSE(task.state.newest().inputs.output_ok);
  CHECK(task.state.newest().inputs.output_reason == Reason::stale);
  const int edges = (*bench.lines)["alive"].edges;
  for (int i = 0; i < 20; ++i) task.step((500 + i * 100) * kMs);
  CHECK(task.counters().old_commands_withheld == 1);
  CHECK(task.counters().writes == 2);
  CHECK((*bench.lines)["alive"].edges == edges);

  // The loop is back: good again with the first command that is put out.
  bench.give(task, 60.0, 3000 * kMs, false);
  task.step(3000 * kMs);
  CHECK_FALSE(task.state.newest().inputs.output_ok);
  bench.give(task, 60.0, 3100 * kMs);
  task.step(3100 * kMs);
  CHECK(bench.raw() == "2720");
  CHECK(task.state.newest().inputs.output_ok);
  CHECK((*bench.lines)["relay"].active);
}

TEST_CASE("without a safe current the last output stays") {
  Bench bench;
  bench.settings.output.safe_ma.reset();
  AnalogTask task = bench.task();
  task.open(0);
  bench.give(task, 50.0, 0);
  task.step(0);
  task.step(10'000 * kMs);
  CHECK(bench.raw() == "2400");
  CHECK(task.counters().old_commands_withheld == 1);
}

TEST_CASE("a command that is already too old when it arrives is never put out") {
  Bench bench;
  AnalogTask task = bench.task();
  task.open(1000 * kMs);
  bench.give(task, 50.0, 599 * kMs);
  task.step(1000 * kMs);
  CHECK(bench.raw() == "700");
}

TEST_CASE("a loop that stopped on purpose keeps its output") {
  Bench bench;
  AnalogTask task = bench.task();
  task.open(0);
  bench.give(task, 50.0, 0);
  task.step(0);
  bench.command.id = 2;
  bench.command.output = 25.0;
  bench.command.parked = true;
  task.commands.publish(bench.command);
  task.step(100 * kMs);
  CHECK(bench.raw() == "1600");
  CHECK_FALSE((*bench.lines)["relay"].active);
  task.step(100'000 * kMs);
  CHECK(bench.raw() == "1600");
  CHECK(task.counters().old_commands_withheld == 0);
}

TEST_CASE("the safe current is tried again until the converter takes it") {
  Bench bench;
  AnalogTask task = bench.task();
  bench.iio.remove(0);
  task.open(0);
  bench.give(task, 50.0, 0);
  task.step(0);
  task.step(500 * kMs);
  bench.iio.add_board(0, "board");
  task.step(1600 * kMs);
  CHECK(bench.raw() == "700");
}

TEST_CASE("counters of the events") {
  Bench bench;
  AnalogTask task = bench.task();
  task.open(0);
  bench.give(task, 50.0, 0);
  task.step(0);
  CHECK(task.counters().transactions == 2);
  CHECK(task.counters().writes == 1);
  CHECK(task.counters().connected);
  bench.iio.change(0, "in_current0_raw", "oops");
  task.step(100 * kMs);
  CHECK(task.counters().invalid_replies == 1);
  CHECK_FALSE(task.counters().connected);
}

}  // namespace analog_task_test
