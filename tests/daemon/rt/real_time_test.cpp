// SPDX-License-Identifier: Apache-2.0
// A cycle makes no allocation, lock or system call: on every backend, with every jacket and
// compensator.
#include <catch2/catch.hpp>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hal/iio/analog_loop_io.hpp"
#include "hal/modbus/modbus_bus.hpp"
#include "hal/modbus/modbus_loop_io.hpp"
#include "base/clock.hpp"
#include "hal/replay/replay_loop_io.hpp"
#include "hal/sim/sim_loop_io.hpp"
#include "tests/daemon/rt/loop_fixture.hpp"
#include "tests/hal/iio/fake_gpio.hpp"
#include "tests/hal/iio/fake_iio.hpp"
#include "tests/hal/modbus/modbus_rig.hpp"
#include "tests/support/rt_guard.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::real_time_test {
namespace {

using control::CompensatorKind;
using control::JacketForm;

effects::EffectSpec spec(const char* name, std::map<std::string, double> parameters) {
  effects::EffectSpec s;
  s.name = name;
  s.parameters = std::move(parameters);
  return s;
}

// A loop model with an effect of every kind, some on a schedule.
plant::LoopModel busy_model() {
  plant::LoopModel model;
  model.controller.pid.output_high = 10.0;
  model.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  model.transmitter = {.low = 0.0, .high = 10.0, .resolution = 10.0 / 4096.0, .noise = 0.01};
  model.valve_effects = {
      spec("stiction", {{"s", 0.5}, {"j", 0.2}}), spec("backlash", {{"deadband", 0.2}}),
      spec("hysteresis", {{"width", 0.2}}), spec("low_air_supply", {{"rate", 2.0}}),
      spec("positioner_overshoot", {{"damping", 0.5}, {"natural_frequency", 2.0}})};
  model.valve_effects.front().options["law"] = "karnopp";
  model.process_effects = {spec("extra_dead_time", {{"seconds", 1.0}}),
                           spec("gain_change", {{"factor", 1.1}})};
  model.transmitter_effects = {spec("extra_lag", {{"time_constant", 0.5}}),
                               spec("drift", {{"rate", 1e-4}})};
  model.disturbances = {spec("oscillating_disturbance", {{"amplitude", 0.1}, {"period", 30.0}}),
                        spec("random_load", {{"intensity", 0.01}})};
  model.scenario.set_point = {{0.0, 3.0}};
  plant::ScheduledFault fault;
  fault.effect = spec("stiction", {{"s", 1.0}, {"j", 0.5}});
  fault.schedule = {.from_s = 10.0, .to_s = 60.0, .ramp_s = 20.0};
  model.scenario.faults = {fault};
  return model;
}

daemon::rt::LoopSettings busy_settings() {
  auto settings = plain_settings();
  settings.controller.pid.output_high = 10.0;
  settings.controller.output = {.low = 0.0, .high = 10.0, .rate_per_s = 5.0, .deadband = 0.0};
  settings.pv_check.high = 10.0;
  return settings;
}

control::CompensatorSettings compensator(CompensatorKind kind) {
  return {.kind = kind,
          .limit = 0.5,
          .amplitude = 0.2,
          .stick_band = 0.3,
          .gap = 0.2,
          .width = 0.2,
          .offset = 0.1,
          .noise_band = 0.01};
}

// A loop that guards each of its cycles. The backend must outlive it.
class GuardedLoop {
 public:
  GuardedLoop(const daemon::rt::LoopSettings& settings, double set_point, hal::LoopIo& io)
      : settings_(settings),
        cycle_(0, kPeriod, settings,
               {.mode = control::Mode::automatic, .set_point = set_point, .output = {}},
               daemon::rt::ValvePositionSource::read_back, {}, io, channels, events_) {
    RealTimeSection::reset();
  }

  record::RecordRow step(std::int64_t now_ns, bool stop = false) {
    ++period_;
    if (period_ % 300 == 0)
      channels.settings.publish({settings_, static_cast<std::uint32_t>(period_)});
    if (period_ % 200 == 0) {
      channels.operator_commands.commands.try_push(
          {.mode = control::Mode::automatic, .set_point = 4.0});
    }
    {
      const RealTimeSection section;
      cycle_.run({.now_ns = now_ns, .period_index = period_}, 0, stop);
    }
    planning_.take_turn();
    while (channels.records.try_pop(row_)) {
    }
    return row_;
  }

  daemon::rt::LoopChannels channels{{.records = 64, .watched = 64}};

 private:
  daemon::rt::LoopSettings settings_;
  base::SpscRing<daemon::rt::Event> events_{64};
  daemon::rt::ControlCycle cycle_;
  daemon::supervision::MovesPlanning planning_{channels, kPeriod, kMovesLease};
  std::uint64_t period_ = 0;
  record::RecordRow row_;
};

void check_no_offence() {
  INFO("last offence: " << RealTimeSection::last_offence());
  CHECK(RealTimeSection::offences() == 0);
}

// Returns the last offence of an action in a guarded section; empty without an offence.
std::string offence_of(const std::function<void()>& thing) {
  RealTimeSection::reset();
  {
    const RealTimeSection section;
    thing();
  }
  return RealTimeSection::last_offence();
}

TEST_CASE("the guard names an allocation, a release, a lock, a write and a read", "[real_time]") {
  void* memory = nullptr;
  // Calls through a volatile pointer. Otherwise the compiler removes both.
  void* (*volatile allocate)(std::size_t) = std::malloc;
  void (*volatile release)(void*) = std::free;
  CHECK(offence_of([&] { memory = allocate(100); }) == "malloc");
  CHECK(offence_of([&] { release(memory); }) == "free");
  CHECK(offence_of([] {}).empty());
  if (!RealTimeSection::sees_locks_and_io()) {
    WARN("under a sanitizer locks and system calls are not looked at");
    return;
  }
  std::mutex mutex;
  CHECK(offence_of([&] { const std::lock_guard lock(mutex); }) == "pthread_mutex_lock");
  std::array<int, 2> ends{};
  REQUIRE(::pipe(ends.data()) == 0);
  char byte = 'x';
  CHECK(offence_of([&] { REQUIRE(::write(ends[1], &byte, 1) == 1); }) == "write");
  byte = ' ';
  CHECK(offence_of([&] { REQUIRE(::read(ends[0], &byte, 1) == 1); }) == "read");
  CHECK(byte == 'x');
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST_CASE("cycles on the simulated backend, through faults and commands, neither allocate nor lock",
          "[real_time]") {
  auto settings = busy_settings();
  SECTION("with each jacket") {
    settings.controller.jacket.form =
        GENERATE(JacketForm::paper, JacketForm::bounded, JacketForm::dwell);
    settings.controller.jacket.shadow = settings.controller.jacket.form == JacketForm::paper;
  }
  SECTION("with each compensator") {
    settings.controller.compensator = compensator(GENERATE(
        CompensatorKind::knocker, CompensatorKind::two_move, CompensatorKind::reinforcement,
        CompensatorKind::backlash, CompensatorKind::hysteresis));
    settings.controller.compensator.shadow =
        control::acts_in_simulation_only(settings.controller.compensator.kind);
  }
  using IoKind = hal::sim::IoFault::Kind;
  hal::sim::SimLoopIo io({.model = busy_model(),
                          .output_resolution = 10.0 / 4096.0,
                          .io_faults = {{IoKind::dead_sensor, 20.0, 25.0},
                                        {IoKind::not_a_number, 30.0, 35.0},
                                        {IoKind::link_lost, 40.0, 45.0},
                                        {IoKind::enable_open, 50.0, 55.0}}});
  GuardedLoop loop(settings, 5.0, io);
  bool computed = false;
  for (std::int64_t k = 1; k <= 2000; ++k) {
    const record::RecordRow row = loop.step(k * kPeriodNs, k > 1900);
    computed = computed || row.jacket_rate_shadow != 0.0F || row.compensator_shadow != 0.0F;
  }
  CHECK(computed);
  check_no_offence();
}

TEST_CASE("cycles with planned moves neither allocate nor lock, whatever these do",
          "[real_time][sim]") {
  plant::LoopModel model;
  model.sample_time_s = kPeriod;
  model.process = {.gain = 1.0, .time_constant_s = 2.0, .dead_time_s = 1.0};
  model.transmitter = {.high = 10.0, .noise = 0.01};
  model.valve_effects = {{.name = "stiction", .parameters = {{"s", 0.6}, {"j", 0.3}}}};
  model.disturbances = {
      {.name = "oscillating_disturbance", .parameters = {{"amplitude", 0.3}, {"period", 20.0}}}};
  auto settings = busy_settings();
  settings.controller = {};
  settings.controller.pid = {.gains = {.kp = 0.2, .ki = 0.1}, .output_high = 10.0};
  settings.controller.output.high = 10.0;
  settings.controller.compensator = {
      .kind = CompensatorKind::planned_moves,
      .planned = {.gain = 1.0, .time_constant_s = 2.0, .dead_time_s = 1.0, .s = 0.6, .j = 0.3}};
  hal::sim::SimLoopIo io({.model = model, .output_resolution = 10.0 / 4096.0, .io_faults = {}});
  GuardedLoop loop(settings, 5.0, io);
  bool acted = false;
  for (std::int64_t k = 1; k <= 8000; ++k) {
    acted = acted || (loop.step(k * kPeriodNs).flags & record::kCompensatorActs) != 0;
  }
  CHECK(acted);
  REQUIRE(loop.channels.moves.read());
  CHECK(loop.channels.moves.read()->phase != control::MovePhase::watching);
  check_no_offence();
}

TEST_CASE("cycles on a Modbus device, present and silent, neither allocate nor lock",
          "[real_time][modbus]") {
  using test::mb::RegisterType;
  test::ForeignProcess device("plant_device.py");
  test::mb::LoopModbusSettings wiring;
  wiring.transmitter_link = wiring.positioner_link = test::tcp_link(device.ready("port"));
  wiring.process_variable = test::input(0, RegisterType::f32);
  wiring.command = test::input(0, RegisterType::f32);
  wiring.command.reg.table = test::mb::Table::holding_register;
  wiring.read_back = test::input(20, RegisterType::f32);
  wiring.output = {.low = 0.0, .high = 10.0, .resolution = 0.01};
  wiring.poll_period_ns = 20'000'000;
  test::mb::ModbusBus bus;
  test::mb::ModbusLoopIo io(wiring, "loop", bus);
  io.open();
  GuardedLoop loop(busy_settings(), 5.0, io);
  record::RecordRow row;
  const auto step = [&] { row = loop.step(base::MonotonicClock().now_ns()); };
  REQUIRE(test::eventually([&] {
    step();
    return std::isfinite(row.pv) && std::isfinite(row.stem) && io.counters().writes > 2;
  }));
  device.freeze();
  CHECK(test::eventually([&] {
    step();
    return !std::isfinite(row.pv) && (row.flags & record::kOutputLost) != 0;
  }));
  device.thaw();
  check_no_offence();
}

TEST_CASE("cycles on 4-20 mA converters, with a current and without, neither allocate nor lock",
          "[real_time][iio]") {
  const FakeIio converters;
  converters.add_board(0, "board");
  const auto lines = std::make_shared<FakeGpio::Lines>();
  (*lines)["enable"].active = true;
  hal::iio::AnalogSettings wiring;
  wiring.iio_root = converters.root();
  wiring.process_variable.channel.device = "board";
  wiring.process_variable.channel.channel = "current0";
  wiring.process_variable.high = 10.0;
  wiring.output.channel = wiring.process_variable.channel;
  wiring.output.high = 10.0;
  wiring.enable =
      hal::iio::EnableSettings{.line = {.chip = "", .line = "enable"}, .debounce_s = 0.0};
  wiring.poll_period_ns = 5'000'000;
  hal::iio::AnalogLoopIo io(wiring, "loop", {}, std::make_unique<FakeGpio>(lines));
  io.open();
  auto settings = busy_settings();
  settings.controller.output.rate_per_s = 1000.0;
  GuardedLoop loop(settings, 5.0, io);
  loop.channels.operator_commands.commands.try_push({.mode = control::Mode::manual, .output = 5.0});
  record::RecordRow row;
  const auto step = [&] { row = loop.step(base::MonotonicClock().now_ns()); };
  REQUIRE(test::eventually([&] {
    step();
    return std::isfinite(row.pv) && io.counters().writes > 2;
  }));
  converters.change(0, "in_current0_raw", "0");  // the transmitter's loop is open
  CHECK(test::eventually([&] {
    step();
    return !std::isfinite(row.pv);
  }));
  check_no_offence();
}

TEST_CASE("cycles on a replayed record, to its end and beyond, neither allocate nor lock",
          "[real_time][replay]") {
  const TemporaryFolder folder;
  std::string text = "time,pv,stem\n";
  for (int k = 0; k < 100; ++k) {
    text += std::to_string(k / 10) + "." + std::to_string(k % 10) + ",5.0" + std::to_string(k) +
            (k % 7 == 3 ? ",\n" : ",4.0\n");
  }
  write_file(folder / "record.csv", text);
  hal::replay::ReplayLoopIo io({.record = (folder / "record.csv").string(),
                                .sample_time_s = kPeriod,
                                .output_high = 10.0,
                                .output_resolution = 0.01});
  io.open();
  GuardedLoop loop(busy_settings(), 5.0, io);
  int known = 0;
  record::RecordRow row;
  for (std::int64_t k = 1; k <= 200; ++k) {
    row = loop.step(k * kPeriodNs);
    known += std::isfinite(row.pv) ? 1 : 0;
  }
  CHECK(known == 100);
  CHECK(row.pv_reason == hal::Reason::end_of_record);
  check_no_offence();
}

}  // namespace
}  // namespace loopwarden::tests::real_time_test
