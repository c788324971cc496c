// SPDX-License-Identifier: Apache-2.0
// Shows one loop in a terminal: a state line and the trend of SP, PV, CO and stem.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "daemon/protocol/answers.hpp"
#include "daemon/protocol/daemon_client.hpp"

namespace loopwarden::workbench {

// The last samples of one loop, fetched in several requests.
class TrendBuffer {
 public:
  explicit TrendBuffer(std::string loop) : loop_(std::move(loop)) {}

  // Fetches the new samples. Throws std::runtime_error.
  void update(protocol::Daemon& daemon);
  const std::string& loop() const noexcept { return loop_; }
  const protocol::Trend& rows() const noexcept { return rows_; }

 private:
  static constexpr std::size_t kKept = 20000;
  std::string loop_;
  protocol::Trend rows_;
};

std::string daemon_line(const protocol::Status& status);
// Returns the writes to the disk with their budget; empty in the first minute.
std::string writes_line(const protocol::DaemonStatus& daemon);
// Returns the feeders and links: lost ones first, a line each, then the others in one line.
std::vector<std::string> connection_lines(const protocol::DaemonStatus& daemon);
// Returns the data that does not reach the disk, with the reasons. Empty: all data does.
std::vector<std::string> disk_troubles(const protocol::DaemonStatus& daemon);
// Returns a note if some of the alarms are suppressed at present, otherwise an empty text.
std::string suppressed_note(const std::vector<protocol::Alarm>& alarms);
// Returns one line per loop; the selected one is marked.
std::vector<std::string> loop_table(const std::vector<protocol::LoopStatus>& loops,
                                    std::size_t selected);
// Returns "area Unit 2/Reactor   slave of TIC-101 (AUTO)" as a line, or an empty text.
std::string place_line(const std::vector<protocol::LoopStatus>& loops, std::size_t at);
// Returns the monitor's result for the valve, the condition indices, and the state of record and
// bus.
std::vector<std::string> loop_details(const protocol::LoopStatus& loop);
// Returns the index of the loop. If the name is unknown, throws DaemonRefused with the nearest tag.
std::size_t loop_index(const std::vector<protocol::LoopStatus>& loops, const std::string& name);
// Draws the last `window_s` seconds in `columns` x `rows`: PV and SP above, CO and stem below.
std::vector<std::string> trend_view(const protocol::LoopStatus& loop, const protocol::Trend& trend,
                                    double window_s, int columns, int rows);

}  // namespace loopwarden::workbench
