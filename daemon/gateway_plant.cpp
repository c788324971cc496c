// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway_plant.hpp"

#include <chrono>
#include <utility>

#include "daemon/loop_health.hpp"

namespace loopwarden::daemon {
namespace {

// A master waits for its answer, and the other masters with it: a slow disk may not keep them long.
constexpr std::chrono::milliseconds kDiskPatience{250};

}  // namespace

GatewayPlant::GatewayPlant(std::vector<LoopRuntime>& loops, const Historian& historian,
                           monitor::WatchBoard& board, journal::Journal& journal,
                           double severe_percent, std::function<gateway::BoxReading()> box)
    : loops_(loops),
      historian_(historian),
      board_(board),
      journal_(journal),
      severe_percent_(severe_percent),
      box_(std::move(box)) {}

gateway::LoopReading GatewayPlant::read(std::size_t loop) {
  const LoopRuntime& runtime = loops_[loop];
  gateway::LoopReading reading(board_.watch(loop));
  reading.running = historian_.latest(loop, reading.row);
  reading.last_good_pv = historian_.last_good_pv(loop);
  reading.set_point_wanted = runtime.channels->set_point_wanted.load(std::memory_order_relaxed);
  reading.settings = runtime.settings->get();
  reading.ne107 = health_of(runtime.config, reading.row, reading.watch, severe_percent_);
  reading.simulated = is_simulated(runtime.config);
  reading.dropped = runtime.channels->records.dropped() + runtime.channels->watched.dropped();
  return reading;
}

std::size_t GatewayPlant::room_for_commands(std::size_t loop) {
  return loops_[loop].channels->master_commands.room();
}

void GatewayPlant::order(std::size_t loop, const rt::OperatorCommand& command) {
  using Kind = rt::OperatorCommand::Kind;
  LoopRuntime& runtime = loops_[loop];
  if (!runtime.channels->master_commands.try_push(command)) return;
  runtime.settings->change([&](rt::LoopSettings& settings) {
    control::PidGains& gains = settings.controller.pid.gains;
    if (command.kind == Kind::kp) gains.kp = command.value;
    if (command.kind == Kind::ki) gains.ki = command.value;
    if (command.kind == Kind::kd) gains.kd = command.value;
  });
}

monitor::OrderResult GatewayPlant::act(std::size_t loop, const monitor::AlarmOrder& order) {
  return board_.act(loop, order, kDiskPatience);
}

void GatewayPlant::veto(std::size_t loop, bool vetoed, const std::string& peer) {
  using loopwarden::monitor::Veto;
  board_.set_veto(loop, vetoed ? Veto::back : Veto::none, peer, {}, kDiskPatience);
}

void GatewayPlant::write_down(journal::JournalEntry entry) { journal_.post(std::move(entry)); }

}  // namespace loopwarden::daemon
