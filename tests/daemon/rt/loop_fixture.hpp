// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/rt/control_cycle.hpp"
#include "daemon/supervision/moves_planning.hpp"
#include "tests/support/fake_loop_io.hpp"

namespace loopwarden::tests {

inline constexpr double kPeriod = 0.1;  // s
inline constexpr std::int64_t kPeriodNs = 100'000'000;
inline constexpr std::uint32_t kMovesLease = 50;  // cycles

inline daemon::rt::LoopSettings plain_settings() {
  daemon::rt::LoopSettings s;
  s.controller.pid.gains = {.kp = 2.0, .ki = 0.5};
  s.controller.pid.anti_windup = control::AntiWindup::back_calculation;
  s.controller.pid.output_high = 100.0;
  s.controller.output = {.low = 0.0, .high = 100.0, .rate_per_s = 50.0, .deadband = 0.0};
  s.controller.set_point.high = 100.0;
  s.pv_check = {
      .low = 0.0, .high = 100.0, .range_margin = 0.05, .max_age_s = 0.3, .frozen_after_s = 0.0};
  s.safety.on_stop = control::OutputAction::go_to(5.0);
  s.safety.on_bad_pv = control::OutputAction::go_to(10.0);
  s.safety.bad_pv_hold_s = 1.0;
  s.safety.on_enable_open = control::OutputAction::go_to(0.0);
  s.safety.recovery = control::Recovery::previous_mode;
  s.safety.recovery_delay_s = 0.5;
  return s;
}

// One loop on a fake backend, run cycle by cycle.
class Loop {
 public:
  explicit Loop(const daemon::rt::LoopSettings& settings = plain_settings(),
                daemon::rt::StartSettings start = {.mode = control::Mode::automatic,
                                                   .set_point = 50.0,
                                                   .output = control::OutputAction::go_to(40.0)},
                daemon::rt::ValvePositionSource source = daemon::rt::ValvePositionSource::none,
                effects::EffectChain valve_model = {})
      : channels({.records = 1024, .watched = 1024}),
        cycle(0, kPeriod, settings, start, source, std::move(valve_model), io, channels, events) {
    io.set_pv(50.0);
  }

  // Runs `cycles` periods; returns the last record.
  record::RecordRow run(int cycles, std::uint64_t missed = 0, bool stop = false) {
    for (int i = 0; i < cycles; ++i) {
      period += 1 + missed;
      now_ns += static_cast<std::int64_t>(1 + missed) * kPeriodNs;
      cycle.run({.now_ns = now_ns, .period_index = period}, missed, stop);
      if (monitor_runs) planning.take_turn();
      while (channels.records.try_pop(row)) {
      }
    }
    return row;
  }
  record::RecordRow run_for(double seconds) {
    return run(static_cast<int>(std::lround(seconds / kPeriod)));
  }
  control::Fault fault() const { return row.fault; }
  control::Mode mode() const { return row.mode; }
  // As the operator; `answer()` tells what became of it.
  bool order(const daemon::rt::Command& order) {
    return channels.operator_commands.commands.try_push(order);
  }
  // Returns the newest one.
  daemon::rt::Refusal answer() {
    daemon::rt::CommandAnswer answer;
    while (channels.operator_commands.answers.try_pop(answer)) {
    }
    return answer.refusal;
  }
  std::vector<daemon::rt::Event> take_events() {
    std::vector<daemon::rt::Event> taken;
    daemon::rt::Event event;
    while (events.try_pop(event)) taken.push_back(event);
    return taken;
  }

  FakeLoopIo io;
  daemon::rt::LoopChannels channels;
  base::SpscRing<daemon::rt::Event> events{1024};
  daemon::rt::ControlCycle cycle;
  // Planned moves, as the monitor's thread steps them.
  daemon::supervision::MovesPlanning planning{channels, kPeriod, kMovesLease};
  bool monitor_runs = true;
  record::RecordRow row;
  std::uint64_t period = 0;
  std::int64_t now_ns = 1'000'000'000;
};

}  // namespace loopwarden::tests
