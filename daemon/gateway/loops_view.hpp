// SPDX-License-Identifier: Apache-2.0
// What the Modbus server may see and do: the loops and the box as the rest of the daemon offers them. The sockets read
// the map's values through the seeing half.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/journal/journal_entry.hpp"
#include "daemon/monitor/watch_board.hpp"
#include "daemon/rt/order.hpp"
#include "record/record_row.hpp"
#include "model/control/planned_moves_settings.hpp"
#include "model/monitor/ne107.hpp"

namespace loopwarden::daemon::gateway {

// One loop at one moment.
struct LoopReading {
  explicit LoopReading(const monitor::LoopWatch& watched) : watch(watched) {}

  bool running = false;  // the row is of a cycle
  record::RecordRow row;
  double last_good_pv = 0.0;      // PV units; 0 before the first
  double set_point_wanted = 0.0;  // PV units, where a ramp goes
  // CO units, what manual holds or goes to; NaN: not known
  double output_wanted = rt::kOutputNotKnown;
  rt::LoopSettings settings;  // in force, ranges and limits included
  rt::Standing standing;      // what the next order will find
  std::uint32_t orders_refused = 0;
  std::optional<control::MovesState> moves;  // planned moves, where there are
  monitor::LoopWatch watch;
  loopwarden::monitor::Ne107 ne107 = loopwarden::monitor::Ne107::normal;
  bool simulated = false;
  std::uint64_t dropped = 0;  // cycles lost by recorder and monitor
};

// The box at one moment.
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
  // Another controller has the loop.
  virtual bool controlled_elsewhere(std::size_t loop) const = 0;
  // It has, or the loop is being commissioned: nothing of it can be written, alarms neither, but for the manual that ends a
  // commissioning.
  virtual bool read_only(std::size_t loop) const = 0;
  virtual LoopReading read(std::size_t loop) = 0;
  virtual BoxReading box() = 0;
};

class LoopsView : public PlantView {
 public:
  // Only the gateway's thread fills the loop's mailbox.
  virtual bool has_room_for_order(std::size_t loop) = 0;
  // Taken by the loop's next cycle. The lines go to the journal with what the cycle made of the order.
  virtual void order(std::size_t loop, const rt::Order& order,
                     std::vector<journal::JournalEntry> lines) = 0;
  // Takes the answers to orders that are there; true while some are still to come.
  virtual bool collect_answers() = 0;
  // The loops have ended: orders without an answer are written down as not taken.
  virtual void close_orders() = 0;
  // The next four wait for nothing. They return the journal's ticket of what was done, 0: nothing was.
  virtual std::uint64_t act(std::size_t loop, const monitor::AlarmOrder& order) = 0;
  // Of every loop, alarms of these kinds.
  virtual std::uint64_t acknowledge_all(std::span<const loopwarden::monitor::AlarmKind> kinds,
                                        const std::string& peer) = 0;
  virtual std::uint64_t veto(std::size_t loop, bool vetoed, const std::string& peer) = 0;
  virtual std::uint64_t begin_offered(std::size_t loop, const std::string& peer) = 0;
  // False while the journal may still come to have all up to the ticket on the disk.
  virtual bool settled(std::uint64_t ticket) = 0;
  virtual void write_down(journal::JournalEntry entry) = 0;
};

}  // namespace loopwarden::daemon::gateway
