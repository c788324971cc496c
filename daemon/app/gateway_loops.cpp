// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/gateway_loops.hpp"

#include <chrono>
#include <utility>

#include "daemon/loops/loop_health.hpp"
#include "daemon/loops/loop_orders.hpp"

namespace loopwarden::daemon {
namespace {

// A master waits for its answer, and the other masters with it: a slow disk may not keep them long.
constexpr std::chrono::milliseconds kDiskPatience{250};

}  // namespace

GatewayLoops::GatewayLoops(std::vector<LoopRuntime>& loops, const Historian& historian,
                           monitor::WatchBoard& board, journal::Journal& journal,
                           double severe_percent, std::function<gateway::BoxReading()> box)
    : loops_(loops),
      historian_(historian),
      board_(board),
      journal_(journal),
      severe_percent_(severe_percent),
      box_(std::move(box)) {
  for (LoopRuntime& loop : loops_) {
    desks_.push_back(
        desk_of(loop, loop.channels->master_orders, journal_, [&loop](const rt::Order& order) {
          loop.settings->change([&](rt::LoopSettings& settings) {
            rt::set_gains(order, settings.controller.pid.gains);
          });
        }));
  }
}

gateway::LoopReading GatewayLoops::read(std::size_t loop) {
  const LoopRuntime& runtime = loops_[loop];
  gateway::LoopReading reading(board_.watch(loop));
  reading.running = historian_.latest(loop, reading.row);
  reading.last_good_pv = historian_.last_good_pv(loop);
  reading.set_point_wanted = runtime.channels->set_point_wanted.load(std::memory_order_relaxed);
  reading.standing = desks_[loop].standing();
  reading.settings = runtime.settings->get();
  // What was ordered reads back at once.
  desks_[loop].for_each_waiting(
      [&](const rt::Order& order) { rt::set_gains(order, reading.settings.controller.pid.gains); });
  reading.orders_refused = runtime.channels->orders_refused.load(std::memory_order_relaxed);
  reading.ne107 = health_of(runtime.config, reading.row, reading.watch, severe_percent_);
  reading.simulated = is_simulated(runtime.config);
  reading.dropped = runtime.channels->records.dropped() + runtime.channels->watched.dropped();
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
  return board_.act(loop, order, kDiskPatience);
}

void GatewayLoops::veto(std::size_t loop, bool vetoed, const std::string& peer) {
  using loopwarden::monitor::Veto;
  board_.set_veto(loop, vetoed ? Veto::back : Veto::none, peer, {}, kDiskPatience);
}

void GatewayLoops::write_down(journal::JournalEntry entry) { journal_.post(std::move(entry)); }

}  // namespace loopwarden::daemon
