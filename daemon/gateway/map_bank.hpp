// SPDX-License-Identifier: Apache-2.0
// The register map filled with the plant's values, and written through to it.
//
// All values of a request come from one reading of each loop it touches. Floats are always finite. A
// value of two registers is written in one request or not at all (exception 3); so is everything else
// that a request writes. Of what it asks of a loop, the mode takes effect first (daemon/rt/order.hpp).
//
// Masters repeat what they write. A write of the value in force is no command: it is left out of
// the request, has no effect and no line in the journal. In force is what the loop's cycle, with
// the master's orders on their way, goes by; the register may show it rounded. Coils, the shelve
// registers, `unshelve_process` and `calm` act on a new value only: a 1 (or a number of minutes)
// that the same master has not written within the last 30 s, and a 0 after its own 1.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "daemon/gateway/modbus_answer.hpp"
#include "daemon/gateway/loops_view.hpp"
#include "daemon/gateway/map_values.hpp"

namespace loopwarden::daemon::gateway {

class MapBank final : public RegisterBank {
 public:
  MapBank(LoopsView& loops, ServerState& server) : loops_(loops), server_(server) {}

  Exception read(register_map::Table table, std::uint16_t address,
                 std::span<std::uint16_t> values) override;
  Exception write(register_map::Table table, std::uint16_t address,
                  std::span<const std::uint16_t> values, const Peer& peer) override;
  // The journal's ticket of what operators did by the writes since the last call; 0: nothing.
  std::uint64_t take_ticket() noexcept { return std::exchange(ticket_, 0); }

 private:
  struct Wish;
  struct LoopCommand;
  Exception collect(register_map::Table table, std::uint16_t address,
                    std::span<const std::uint16_t> values, std::vector<Wish>& wishes) const;
  static bool takes_back(const std::vector<Wish>& wishes, std::size_t loop);
  Exception check(std::vector<Wish>& wishes, MapValues& snapshot);
  void find_in_force(std::vector<Wish>& wishes, MapValues& snapshot) const;
  static std::vector<LoopCommand> orders_of(const std::vector<Wish>& wishes);
  journal::JournalEntry line_of(const Wish& wish, const Peer& peer, MapValues& snapshot);
  bool is_new(const Wish& wish, const Peer& peer, double now_s);
  void act(const Wish& wish, const Peer& peer, MapValues& snapshot);
  void act_on_process_alarms(const Wish& wish, const Peer& peer);
  void calm(const Wish& wish, const Peer& peer);

  LoopsView& loops_;
  ServerState& server_;
  std::uint64_t ticket_ = 0;
  // Values that masters hold in momentary registers and coils, by host and address; never 0.
  struct Held {
    std::uint16_t value = 0;
    double written_s = 0.0;  // uptime of the newest write
  };
  std::map<std::tuple<std::string, register_map::Table, std::uint32_t>, Held> held_;
};

}  // namespace loopwarden::daemon::gateway
