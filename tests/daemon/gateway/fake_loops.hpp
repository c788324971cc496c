// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "daemon/gateway/loops_view.hpp"
#include "tests/daemon/rt/loop_fixture.hpp"

namespace loopwarden::tests {

// Loops that never move, and that record the requests to them.
class FakeLoops final : public daemon::gateway::LoopsView {
 public:
  explicit FakeLoops(std::size_t loops) {
    const daemon::supervision::AlarmSnapshot watch({}, 0.1);
    for (std::size_t i = 0; i < loops; ++i) {
      names_.push_back("FIC-10" + std::to_string(i));
      daemon::gateway::LoopReading reading(watch);
      reading.running = true;
      reading.settings = plain_settings();
      reading.settings.controller.set_point = {.low = 10.0, .high = 90.0};
      reading.row.period_index = 70'000 + i;
      reading.row.sp = 50.0;
      reading.row.pv = 49.5;
      reading.row.co = 25.0;
      reading.row.stem = 24.0;
      reading.row.mode = control::Mode::automatic;
      reading.row.requested_mode = control::Mode::automatic;
      reading.row.pv_quality = base::Quality::good;
      reading.set_point_wanted = 60.0;
      reading.output_wanted = 25.0;
      reading.availability = {.mode = control::Mode::automatic, .output_known = true};
      readings.push_back(reading);
    }
    box_reading.utc_ms = 1'800'000'000'123;
    box_reading.uptime_s = 65'540.7;
  }

  std::size_t loops() const override { return readings.size(); }
  bool controlled_elsewhere(std::size_t loop) const override { return watched.contains(loop); }
  bool read_only(std::size_t loop) const override {
    return watched.contains(loop) || commissioned.contains(loop);
  }
  const std::string& name(std::size_t loop) const override { return names_[loop]; }
  daemon::gateway::LoopReading read(std::size_t loop) override {
    ++reads;
    return readings[loop];
  }
  daemon::gateway::BoxReading box() override { return box_reading; }
  bool has_room_for_command(std::size_t) override { return room; }
  // Every cycle takes every command.
  void send(std::size_t loop, const daemon::rt::Command& order,
            std::vector<daemon::journal::JournalEntry> of_order) override {
    commands.emplace_back(loop, order);
    if (order.ends_commissioning) commissioned.erase(loop);
    for (daemon::journal::JournalEntry& line : of_order) {
      line.result = "done";
      lines.push_back(std::move(line));
    }
  }
  bool collect_answers() override { return false; }
  void close_commands() override {}
  std::uint64_t act(std::size_t loop, const daemon::supervision::AlarmCommand& order) override {
    actions.emplace_back(loop, order);
    return posted();
  }
  std::uint64_t acknowledge_all(std::span<const alarm::AlarmKind> kinds,
                                const std::string& peer) override {
    acknowledged_by.push_back(peer);
    acknowledged_kinds.assign(kinds.begin(), kinds.end());
    return posted();
  }
  std::uint64_t veto(std::size_t loop, bool vetoed, const std::string&) override {
    vetoes.emplace_back(loop, vetoed);
    return posted();
  }
  std::uint64_t begin_offered(std::size_t loop, const std::string&) override {
    begun.push_back(loop);
    return posted();
  }
  bool settled(std::uint64_t ticket) override { return ticket <= on_disk; }
  void write_down(daemon::journal::JournalEntry entry) override {
    lines.push_back(std::move(entry));
  }

  std::vector<daemon::gateway::LoopReading> readings;
  daemon::gateway::BoxReading box_reading;
  bool room = true;
  std::set<std::size_t> watched;  // another controller has them
  std::set<std::size_t> commissioned;
  std::size_t reads = 0;
  std::vector<std::pair<std::size_t, daemon::rt::Command>> commands;
  std::vector<std::pair<std::size_t, daemon::supervision::AlarmCommand>> actions;
  std::vector<std::string> acknowledged_by;
  std::vector<alarm::AlarmKind> acknowledged_kinds;  // that the last of them meant
  std::vector<std::pair<std::size_t, bool>> vetoes;
  std::vector<std::size_t> begun;
  std::uint64_t newest_ticket = 0;
  std::uint64_t on_disk = ~std::uint64_t{0};  // tickets up to this one
  std::function<void()> on_action;            // within each action
  std::vector<daemon::journal::JournalEntry> lines;

 private:
  std::uint64_t posted() {
    if (on_action) on_action();
    return ++newest_ticket;
  }

  std::vector<std::string> names_;
};

}  // namespace loopwarden::tests
