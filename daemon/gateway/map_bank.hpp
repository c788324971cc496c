// SPDX-License-Identifier: Apache-2.0
// Serves the register map: reads the plant's values and writes commands.
//
// All values of a request are from one reading of each loop. Floats are always finite. A value of
// two registers must be written in one request (otherwise exception 3). A write request takes
// effect completely or not at all. For a loop, its mode takes effect first (daemon/rt/command.hpp).
//
// Masters repeat their writes. A write of the value in force is not a command: it has no effect and
// no line in the journal. The value in force is that of the loop's cycle, including the master's
// pending commands; the register may show it rounded.
//
// Coils, the shelve registers, `unshelve_process` and `calm` act on a new value only. New is a 1
// (or a number of minutes) that the same master has not written within the last 30 s. A 0 is new
// only after the master's own 1.
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

  Exception read(registers::Table table, std::uint16_t address,
                 std::span<std::uint16_t> values) override;
  Exception write(registers::Table table, std::uint16_t address,
                  std::span<const std::uint16_t> values, const Peer& peer) override;
  // Returns the journal's ticket of operator actions by writes since the last call; 0: no action.
  std::uint64_t take_ticket() noexcept { return std::exchange(ticket_, 0); }

 private:
  struct Wish;
  struct LoopCommand;
  Exception collect(registers::Table table, std::uint16_t address,
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
  // Values that masters hold in momentary registers and coils, by host and address. Never 0.
  struct Held {
    std::uint16_t value = 0;
    double written_s = 0.0;  // uptime at the newest write
  };
  std::map<std::tuple<std::string, registers::Table, std::uint32_t>, Held> held_;
};

}  // namespace loopwarden::daemon::gateway
