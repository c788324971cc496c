// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/gateway_loops.hpp"

#include <utility>

#include "daemon/loops/loop_queue.hpp"

namespace loopwarden::daemon {
GatewayLoops::GatewayLoops(const console::Plant& plant, journal::Journal& journal,
                           const console::DaemonInfo& info)
    : plant_(plant), journal_(journal), readings_(plant, info) {
  for (LoopRuntime& loop : plant_.loops) {
    queues_.push_back(queue_of(loop, loop.channels->master_commands, journal_));
  }
}

gateway::LoopReading GatewayLoops::read(std::size_t loop) {
  gateway::LoopReading reading = readings_.read(loop);
  // Includes waiting commands, so that a master reads back its values at once.
  const rt::InForce now = in_force(plant_.loops[loop], queues_[loop]);
  reading.availability = queues_[loop].availability();
  reading.set_point_wanted = now.set_point;
  reading.output_wanted = now.output;
  control::PidGains& gains = reading.settings.controller.pid.gains;
  gains.kp = now.kp;
  gains.ki = now.ki;
  gains.kd = now.kd;
  return reading;
}

void GatewayLoops::send(std::size_t loop, const rt::Command& command,
                        std::vector<journal::JournalEntry> lines) {
  queues_[loop].send(command, std::move(lines));
}

bool GatewayLoops::collect_answers() {
  bool waiting = false;
  for (commands::CommandQueue& queue : queues_) {
    queue.collect();
    waiting = waiting || queue.waiting();
  }
  return waiting;
}

void GatewayLoops::close_commands() {
  for (commands::CommandQueue& queue : queues_) queue.close();
}

std::uint64_t GatewayLoops::act(std::size_t loop, const supervision::AlarmCommand& command) {
  return plant_.alarms.act(loop, command).ticket;
}

std::uint64_t GatewayLoops::acknowledge_all(std::span<const alarm::AlarmKind> kinds,
                                            const std::string& peer) {
  return plant_.alarms.acknowledge_all(kinds, peer, {}).ticket;
}

std::uint64_t GatewayLoops::veto(std::size_t loop, bool vetoed, const std::string& peer) {
  using alarm::Veto;
  return plant_.alarms.of(loop).set_veto(vetoed ? Veto::back : Veto::none, peer, {}).ticket;
}

std::uint64_t GatewayLoops::begin_offered(std::size_t loop, const std::string& peer) {
  return plant_.alarms.of(loop).begin_offered(peer, {}).ticket;
}

bool GatewayLoops::settled(std::uint64_t ticket) {
  return journal_.written(ticket) != journal::Written::not_yet;
}

void GatewayLoops::write_down(journal::JournalEntry entry) { journal_.post(std::move(entry)); }

}  // namespace loopwarden::daemon
