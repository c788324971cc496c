// SPDX-License-Identifier: Apache-2.0
// The daemon's loops as the Modbus server sees them. Used by the server's thread alone.
#pragma once

#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "daemon/gateway/loops_view.hpp"
#include "daemon/recorder/historian.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/loop_runtime.hpp"
#include "daemon/monitor/watch_board.hpp"
#include "daemon/orders/order_desk.hpp"

namespace loopwarden::daemon {

class GatewayLoops final : public gateway::LoopsView {
 public:
  GatewayLoops(std::vector<LoopRuntime>& loops, const Historian& historian,
               monitor::WatchBoard& board, journal::Journal& journal, double severe_percent,
               std::function<gateway::BoxReading()> box);

  std::size_t loops() const override { return loops_.size(); }
  const std::string& name(std::size_t loop) const override { return loops_[loop].config.name; }
  gateway::LoopReading read(std::size_t loop) override;
  gateway::BoxReading box() override { return box_(); }
  bool has_room_for_order(std::size_t loop) override { return desks_[loop].has_room(); }
  void order(std::size_t loop, const rt::Order& order,
             std::vector<journal::JournalEntry> lines) override;
  bool collect_answers() override;
  void close_orders() override;
  monitor::OrderResult act(std::size_t loop, const monitor::AlarmOrder& order) override;
  void veto(std::size_t loop, bool vetoed, const std::string& peer) override;
  void write_down(journal::JournalEntry entry) override;

 private:
  std::vector<LoopRuntime>& loops_;
  const Historian& historian_;
  monitor::WatchBoard& board_;
  journal::Journal& journal_;
  double severe_percent_;
  std::function<gateway::BoxReading()> box_;
  std::deque<orders::OrderDesk> desks_;  // one for each loop
};

}  // namespace loopwarden::daemon
