// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/gateway_loops.hpp"

#include <utility>

#include "daemon/loops/loop_orders.hpp"

namespace loopwarden::daemon {
GatewayLoops::GatewayLoops(console::Parts parts) : parts_(std::move(parts)) {
  for (LoopRuntime& loop : parts_.loops) {
    desks_.push_back(desk_of(loop, loop.channels->master_orders, parts_.journal));
  }
}

gateway::LoopReading GatewayLoops::read(std::size_t loop) {
  gateway::LoopReading reading = readings_.read(loop);
  // A command reads back at once, before the cycle takes it.
  const rt::InForce now = in_force(parts_.loops[loop], desks_[loop]);
  reading.standing = desks_[loop].standing();
  reading.set_point_wanted = now.set_point;
  reading.output_wanted = now.output;
  control::PidGains& gains = reading.settings.controller.pid.gains;
  gains.kp = now.kp;
  gains.ki = now.ki;
  gains.kd = now.kd;
  return reading;
}

void GatewayLoops::order(std::size_t loop, const rt::Order& order,
                         std::vector<journal::JournalEntry> lines) {
  desks_[loop].send(order, std::move(lines));
}

bool GatewayLoops::collect_answers() {
  bool waiting = false;
  for (orders::OrderDesk& desk : desks_) {
    desk.collect();
    waiting = waiting || desk.waiting();
  }
  return waiting;
}

void GatewayLoops::close_orders() {
  for (orders::OrderDesk& desk : desks_) desk.close();
}

std::uint64_t GatewayLoops::act(std::size_t loop, const supervision::AlarmOrder& order) {
  return parts_.board.act(loop, order).ticket;
}

std::uint64_t GatewayLoops::acknowledge_all(std::span<const alarm::AlarmKind> kinds,
                                            const std::string& peer) {
  return parts_.board.acknowledge_all(kinds, peer, {}).ticket;
}

std::uint64_t GatewayLoops::veto(std::size_t loop, bool vetoed, const std::string& peer) {
  using alarm::Veto;
  return parts_.board.set_veto(loop, vetoed ? Veto::back : Veto::none, peer, {}).ticket;
}

std::uint64_t GatewayLoops::begin_offered(std::size_t loop, const std::string& peer) {
  return parts_.board.begin_offered(loop, peer, {}).ticket;
}

bool GatewayLoops::settled(std::uint64_t ticket) {
  return parts_.journal.written(ticket) != journal::Written::not_yet;
}

void GatewayLoops::write_down(journal::JournalEntry entry) {
  parts_.journal.post(std::move(entry));
}

}  // namespace loopwarden::daemon
