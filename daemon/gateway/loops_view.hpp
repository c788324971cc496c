// SPDX-License-Identifier: Apache-2.0
// The interface of the Modbus server to the daemon's loops and the box. PlantView reads; LoopsView
// also writes. The sockets read the map's values through PlantView.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/rt/command.hpp"
#include "daemon/supervision/alarm_registry.hpp"
#include "daemon/journal/journal_entry.hpp"
#include "record/record_row.hpp"
#include "model/control/planned_moves_settings.hpp"
#include "model/alarm/ne107.hpp"

namespace loopwarden::daemon::gateway {

// The state of one loop at one moment.
struct LoopReading {
  explicit LoopReading(const supervision::AlarmSnapshot& watched) : watch(watched) {}

  bool running = false;  // the row is from a cycle
  record::RecordRow row;
  double last_good_pv = 0.0;      // PV units; 0 before the first good PV
  double set_point_wanted = 0.0;  // PV units, end of the ramp
  // CO units, output that manual holds or moves to; NaN: unknown
  double output_wanted = rt::kOutputNotKnown;
  rt::LoopSettings settings;          // in force, ranges and limits included
  rt::LoopAvailability availability;  // what the next command will find
  std::uint32_t orders_refused = 0;
  std::optional<control::MovesState> moves;  // planned moves, where there are
  supervision::AlarmSnapshot watch;
  alarm::Ne107 ne107 = alarm::Ne107::normal;
  bool simulated = false;
  std::uint64_t dropped = 0;  // cycles lost by recorder and monitor
};

// The state of the box at one moment.
struct BoxReading {
  std::int64_t utc_ms = 0;
  double uptime_s = 0.0;
  std::uint64_t overruns = 0;
  double wake_up_worst_us = 0.0;
  double wake_up_p99_us = 0.0;
  std::uint32_t config_hash = 0;
  std::uint32_t model_hash = 0;
  bool real_time_rights = true;
  bool any_simulated = false;
  bool journal_trouble = false;
  std::uint64_t journal_waiting = 0;
  std::uint64_t journal_lost = 0;
  std::uint64_t window_backlog = 0;
  std::uint64_t monitor_dropped = 0;
  unsigned box_alarms = 0;  // bits
};

class PlantView {
 public:
  PlantView() = default;
  PlantView(const PlantView&) = delete;
  PlantView& operator=(const PlantView&) = delete;
  virtual ~PlantView() = default;

  virtual std::size_t loops() const = 0;
  virtual const std::string& name(std::size_t loop) const = 0;
  // Returns whether another controller runs the loop.
  virtual bool controlled_elsewhere(std::size_t loop) const = 0;
  // Returns whether writes to the loop are refused, including those to its alarms. This is so if
  // another controller runs the loop, or while it is being commissioned. Only the change to manual,
  // which ends the commissioning, is accepted then.
  virtual bool read_only(std::size_t loop) const = 0;
  virtual LoopReading read(std::size_t loop) = 0;
  virtual BoxReading box() = 0;
};

class LoopsView : public PlantView {
 public:
  // Only the gateway's thread fills the loop's mailbox.
  virtual bool has_room_for_command(std::size_t loop) = 0;
  // Sends the command, which the loop's next cycle takes. The lines are written to the journal with
  // its result.
  virtual void send(std::size_t loop, const rt::Command& command,
                    std::vector<journal::JournalEntry> lines) = 0;
  // Takes the available answers to commands. Returns true while others are missing.
  virtual bool collect_answers() = 0;
  // Call it after the loops have ended: unanswered commands are written as not taken.
  virtual void close_commands() = 0;
  // The next four wait for nothing. They return the journal's ticket of what was done, 0: nothing
  // was.
  virtual std::uint64_t act(std::size_t loop, const supervision::AlarmCommand& command) = 0;
  // Of every loop, alarms of these kinds.
  virtual std::uint64_t acknowledge_all(std::span<const alarm::AlarmKind> kinds,
                                        const std::string& peer) = 0;
  virtual std::uint64_t veto(std::size_t loop, bool vetoed, const std::string& peer) = 0;
  virtual std::uint64_t begin_offered(std::size_t loop, const std::string& peer) = 0;
  // Returns false while the journal may still write lines up to the ticket to the disk.
  virtual bool settled(std::uint64_t ticket) = 0;
  virtual void write_down(journal::JournalEntry entry) = 0;
};

}  // namespace loopwarden::daemon::gateway
