// SPDX-License-Identifier: Apache-2.0
// The picture of one loop in a terminal: state line, trend of SP, PV, CO and stem.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "daemon/protocol/answers.hpp"
#include "daemon/protocol/daemon_client.hpp"

namespace loopwarden::workbench {

// The last samples of one loop, fetched piece by piece.
class TrendBuffer {
 public:
  explicit TrendBuffer(std::string loop) : loop_(std::move(loop)) {}

  // Fetches what is new. Throws std::runtime_error.
  void update(protocol::Daemon& daemon);
  const std::string& loop() const noexcept { return loop_; }
  const protocol::Trend& rows() const noexcept { return rows_; }

 private:
  static constexpr std::size_t kKept = 20000;
  std::string loop_;
  protocol::Trend rows_;
};

std::string daemon_line(const protocol::Status& status);
// What does not reach the disk, and why; none: all does.
std::vector<std::string> disk_troubles(const protocol::DaemonStatus& daemon);
// What it means that some of those that are off can't come at present; empty where all can.
std::string suppressed_note(const std::vector<protocol::Alarm>& alarms);
// One line a loop; the selected one is marked.
std::vector<std::string> loop_table(const std::vector<protocol::LoopStatus>& loops,
                                    std::size_t selected);
// What the monitor says of the valve, the condition indices, and how record and bus do.
std::vector<std::string> loop_details(const protocol::LoopStatus& loop);
// Its place among the loops. Throws DaemonRefused, with the nearest tag, if there is none of that name.
std::size_t loop_index(const std::vector<protocol::LoopStatus>& loops, const std::string& name);
// The last `window_s` seconds in a frame of `columns` x `rows`: PV and SP above, CO and stem below.
std::vector<std::string> trend_view(const protocol::LoopStatus& loop, const protocol::Trend& trend,
                                    double window_s, int columns, int rows);

}  // namespace loopwarden::workbench
