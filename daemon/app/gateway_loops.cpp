// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/gateway_loops.hpp"

#include <chrono>
#include <utility>

#include "daemon/loops/loop_orders.hpp"

namespace loopwarden::daemon {
namespace {

// A master waits for its answer, and the other masters with it: a slow disk may not keep them long.
constexpr std::chrono::milliseconds kDiskPatience{250};

}  // namespace

GatewayLoops::GatewayLoops(console::Parts parts) : parts_(std::move(parts)) {
  for (LoopRuntime& loop : parts_.loops) {
    desks_.push_back(desk_of(loop, loop.channels->master_orders, parts_.journal));
  }
}

gateway::LoopReading GatewayLoops::read(std::size_t loop) {
  gateway::LoopReading reading = readings_.read(loop);
  reading.standing = desks_[loop].standing();
  // What was ordered reads back at once.
  desks_[loop].for_each_waiting(
      [&](const rt::Order& order) { rt::set_gains(order, reading.settings.controller.pid.gains); });
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

monitor::OrderResult GatewayLoops::act(std::size_t loop, const monitor::AlarmOrder& order) {
  return parts_.board.act(loop, order, kDiskPatience);
}

void GatewayLoops::veto(std::size_t loop, bool vetoed, const std::string& peer) {
  using loopwarden::monitor::Veto;
  parts_.board.set_veto(loop, vetoed ? Veto::back : Veto::none, peer, {}, kDiskPatience);
}

void GatewayLoops::write_down(journal::JournalEntry entry) {
  parts_.journal.post(std::move(entry));
}

}  // namespace loopwarden::daemon
