// SPDX-License-Identifier: Apache-2.0
// The register map filled with the plant's values, and written through to it.
//
// All values of a request come from one reading of each loop it touches. Floats are always finite. A
// value of two registers is written in one request or not at all (exception 3); so is everything else
// that a request writes. Of what it asks of a loop, the mode takes effect first (daemon/rt/order.hpp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "daemon/gateway/modbus_answer.hpp"
#include "daemon/gateway/loops_view.hpp"
#include "hal/modbus/modbus_settings.hpp"

namespace loopwarden::daemon::gateway {

// What the server itself knows; written by it, read into the map.
struct ServerState {
  bool writes_enabled = false;
  bool master_lost = false;
  std::uint16_t master_heartbeat = 0;
  bool master_beat = false;  // a master has written its heartbeat since this was last cleared
  std::uint16_t clients = 0;
};

class MapBank final : public RegisterBank {
 public:
  MapBank(LoopsView& loops, hal::modbus::ByteOrder order, ServerState& server)
      : loops_(loops), order_(order), server_(server) {}

  Exception read(register_map::Table table, std::uint16_t address,
                 std::span<std::uint16_t> values) override;
  Exception write(register_map::Table table, std::uint16_t address,
                  std::span<const std::uint16_t> values, const Peer& peer) override;

 private:
  struct Wish;
  struct LoopOrder;
  class Snapshot;
  Exception collect(register_map::Table table, std::uint16_t address,
                    std::span<const std::uint16_t> values, std::vector<Wish>& wishes) const;
  Exception check(std::vector<Wish>& wishes, Snapshot& snapshot);
  static std::vector<LoopOrder> orders_of(const std::vector<Wish>& wishes);
  static rt::Refusal judge(LoopOrder& asked, const LoopReading& loop);
  journal::JournalEntry line_of(const Wish& wish, const Peer& peer, Snapshot& snapshot);
  void act(const Wish& wish, const Peer& peer);
  void acknowledge_all(const Peer& peer);

  LoopsView& loops_;
  hal::modbus::ByteOrder order_;
  ServerState& server_;
};

}  // namespace loopwarden::daemon::gateway
