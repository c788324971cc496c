// SPDX-License-Identifier: Apache-2.0
// No allocation, lock or system call in a cycle, with every backend.
#include <catch2/catch.hpp>

#include <mutex>
#include <vector>

#include "hal/sim/sim_loop_io.hpp"
#include "tests/daemon/rt/loop_fixture.hpp"
#include "tests/support/rt_guard.hpp"

namespace loopwarden::tests::real_time_test {
namespace {

plant::EffectSpec spec(const char* name, std::map<std::string, double> parameters) {
  plant::EffectSpec s;
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

TEST_CASE("the guard sees an allocation, a lock and a write") {
  if (!RealTimeSection::effective()) return;
  RealTimeSection::reset();
  std::mutex mutex;
  {
    const RealTimeSection section;
    std::vector<int> grows;
    grows.reserve(100);
    const std::lock_guard lock(mutex);
  }
  CHECK(RealTimeSection::offences() >= 2);
}

TEST_CASE("cycles on the simulated backend, through faults and orders, neither allocate nor lock") {
  auto settings = plain_settings();
  settings.controller.pid.output_high = 10.0;
  settings.controller.output = {.low = 0.0, .high = 10.0, .rate_per_s = 5.0, .deadband = 0.0};
  settings.pv_check.high = 10.0;
  settings.controller.jacket.form = GENERATE(
      control::JacketForm::paper, control::JacketForm::bounded, control::JacketForm::dwell);
  using IoKind = hal::sim::IoFault::Kind;
  hal::sim::SimLoopIo io({.model = busy_model(),
                          .output_resolution = 10.0 / 4096.0,
                          .io_faults = {{IoKind::dead_sensor, 20.0, 25.0},
                                        {IoKind::not_a_number, 30.0, 35.0},
                                        {IoKind::link_lost, 40.0, 45.0},
                                        {IoKind::enable_open, 50.0, 55.0}}});
  daemon::rt::LoopChannels channels(64);
  hal::os::SpscRing<daemon::rt::Event> events(64);
  plant::EffectChain valve_model;
  daemon::rt::ControlCycle cycle(
      0, kPeriod, settings, {.mode = control::Mode::automatic, .set_point = 5.0, .output = {}},
      daemon::rt::ValvePositionSource::read_back, std::move(valve_model), io, channels, events);
  RealTimeSection::reset();
  {
    const RealTimeSection section;
    for (std::uint64_t k = 1; k <= 2000; ++k) {
      if (k % 300 == 0) channels.settings.publish(settings);
      if (k % 200 == 0)
        channels.operator_orders.orders.try_push(
            {.mode = control::Mode::automatic, .set_point = 4.0});
      cycle.run({.now_ns = static_cast<std::int64_t>(k) * kPeriodNs, .period_index = k}, 0,
                k > 1900);
    }
  }
  INFO("last offence: " << RealTimeSection::last_offence());
  CHECK(RealTimeSection::offences() == 0);
}

}  // namespace
}  // namespace loopwarden::tests::real_time_test
