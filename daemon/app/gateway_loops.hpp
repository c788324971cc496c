// SPDX-License-Identifier: Apache-2.0
// The daemon's loops as seen by the Modbus server. For the server's thread only.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <vector>

#include "daemon/console/daemon_info.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/console/plant_readings.hpp"
#include "daemon/gateway/loops_view.hpp"
#include "daemon/commands/command_queue.hpp"

namespace loopwarden::daemon {

class GatewayLoops final : public gateway::LoopsView {
 public:
  GatewayLoops(const console::Plant& plant, journal::Journal& journal,
               const console::DaemonInfo& info);

  std::size_t loops() const override { return readings_.loops(); }
  const std::string& name(std::size_t loop) const override { return readings_.name(loop); }
  bool controlled_elsewhere(std::size_t loop) const override {
    return readings_.controlled_elsewhere(loop);
  }
  bool read_only(std::size_t loop) const override { return readings_.read_only(loop); }
  gateway::LoopReading read(std::size_t loop) override;
  gateway::BoxReading box() override { return readings_.box(); }
  bool has_room_for_command(std::size_t loop) override { return queues_[loop].has_room(); }
  void send(std::size_t loop, const rt::Command& command,
            std::vector<journal::JournalEntry> lines) override;
  bool collect_answers() override;
  void close_commands() override;
  std::uint64_t act(std::size_t loop, const supervision::AlarmCommand& command) override;
  std::uint64_t acknowledge_all(std::span<const alarm::AlarmKind> kinds,
                                const std::string& peer) override;
  std::uint64_t veto(std::size_t loop, bool vetoed, const std::string& peer) override;
  std::uint64_t begin_offered(std::size_t loop, const std::string& peer) override;
  bool settled(std::uint64_t ticket) override;
  void write_down(journal::JournalEntry entry) override;

 private:
  console::Plant plant_;
  journal::Journal& journal_;
  console::PlantReadings readings_;
  std::deque<commands::CommandQueue> queues_;  // one for each loop
};

}  // namespace loopwarden::daemon
